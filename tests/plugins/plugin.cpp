// Terms that expressions can say as well, so that tests compare both; and, by the macros of tests/CMakeLists.txt,
// plug-ins that are wrong.
#include <cmath>
#include <stdexcept>

#include "core/force/differentiated_force.hpp"
#include "core/run/differentiated_cost.hpp"
#include "optim/problem/plugin.hpp"

#ifndef NO_PLUGIN
namespace {

using namespace mbsopt;

struct Drag final : DifferentiatedForce<Drag> {  // F = -c v at the centre of mass, on two bodies -c v and -2 c v
  explicit Drag(std::vector<std::string> bodies) : names(std::move(bodies)) {}
  std::vector<std::string> bodies() const override { return names; }
  template <class T>
  void load(double, const VectorX<T>&, const VectorX<T>& v, const VectorX<T>& rho, VectorX<T>& Q) const {
    Q.template head<3>() = -rho(0) * v.template head<3>();
    if (names.size() == 2) Q.template segment<3>(7) = -2. * rho(0) * v.template segment<3>(7);
  }
  std::vector<std::string> names;
};

struct WrongDrag final : UserForce {
  std::vector<std::string> bodies() const override { return {"rod"}; }
  void Q(double, VecIn, VecIn v, VecIn rho, VecOut Q) const override { Q.head<3>() = -rho(0) * v.head<3>(); }
  void K(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void C(double, VecIn, VecIn, VecIn rho, MatOut C) const override { C.diagonal().head<3>().setConstant(2 * rho(0)); }
  void Q_rho(double, VecIn, VecIn v, VecIn, MatOut Q_rho) const override { Q_rho.col(0).head<3>() = -v.head<3>(); }
};

struct Thrower final : UserForce {
  std::vector<std::string> bodies() const override { return {"rod"}; }
  void Q(double t, VecIn, VecIn, VecIn, VecOut) const override {
    if (t > 0.1) throw std::domain_error("no table beyond 0.1 s");
  }
  void K(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
};

struct Effort final : DifferentiatedRunningCost<Effort> {  // w rdot'rdot of the last body
  template <class T>
  T integrand(double, const VectorX<T>& y, const VectorX<T>& rho) const {
    return rho(0) * y.segment(y.size() - 7, 3).squaredNorm();
  }
};
struct Height final : DifferentiatedTerminalCost<Height> {  // w y^2 of the first body
  template <class T>
  T at_end(const VectorX<T>& y, const VectorX<T>& rho) const {
    return rho(0) * y(1) * y(1);
  }
};

}  // namespace

#ifdef OTHER_INTERFACE
extern "C" const char* mbsopt_plugin_interface() { return "mbsopt 99"; }
extern "C" void mbsopt_plugin(mbsopt::NamedTerms&) {}
#else
MBSOPT_PLUGIN(terms) {
#ifdef THROWING
  throw std::runtime_error("the licence has expired");
#endif
  terms.add_force("drag", {"c"}, std::make_shared<Drag>(std::vector<std::string>{"rod"}));
  terms.add_force("two_drags", {"c"}, std::make_shared<Drag>(std::vector<std::string>{"rod", "bob"}));
  terms.add_force("wrong_drag", {"c"}, std::make_shared<WrongDrag>());
  terms.add_force("thrower", {}, std::make_shared<Thrower>());
  terms.add_cost("effort", {"w"}, std::make_shared<Effort>(), std::make_shared<Height>());
  terms.add_law("sine", [](double x, int order) { return std::sin(x + order * std::asin(1.0)); });
  terms.add_law("wrong_sine",
                [](double x, int order) { return order == 2 ? std::sin(x) : std::sin(x + order * std::asin(1.0)); });
}
#endif
#endif
