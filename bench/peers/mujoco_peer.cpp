// MuJoCo: joint coordinates, loops closed by its regularised equality constraints (connect), stiff and critically
// damped; a spatial hinge that closes a loop is two of them, on its axis. Runs: its Runge-Kutta method of order 4,
// whose steps are fixed.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <cstring>
#include <stdexcept>

#include "bench/peers/peer.hpp"
#include "bench/repeated.hpp"

namespace mbsopt::bench {
namespace {

constexpr int kDeepest = 90;  // bodies in a row: the reader of model files stops at 100 nested elements

std::string text(const Vector3d& x) { return fmt::format("{:.17g} {:.17g} {:.17g}", x(0), x(1), x(2)); }
std::string name(int rod) { return fmt::format("rod{}", rod); }

std::string model_text(const Linkage& linkage) {
  const SpanningTree tree = spanning_tree(linkage);
  std::vector<std::vector<std::size_t>> children(linkage.rods.size() + 1);
  for (std::size_t k = 0; k < tree.branches.size(); ++k)
    children[static_cast<std::size_t>(tree.branches[k].parent + 1)].push_back(k);
  std::string out = fmt::format(
      "<mujoco><compiler angle=\"radian\"/><size njmax=\"{}\" nconmax=\"1\"/>"
      "<option gravity=\"{}\" integrator=\"RK4\" solver=\"Newton\" tolerance=\"1e-14\" iterations=\"50\">"
      "<flag contact=\"disable\" limit=\"disable\"/></option><worldbody>",
      6 * tree.closing.size() + 10, text(linkage.gravity));
  const auto add = [&](auto&& self, std::size_t branch) -> void {
    const auto& [parent, rod, hinge] = tree.branches[branch];
    const Linkage::Rod& r = linkage.rod(rod);
    const Linkage::Hinge& h = linkage.hinges[static_cast<std::size_t>(hinge)];
    out += fmt::format(
        "<body name=\"{}\" pos=\"{}\"><inertial pos=\"0 0 0\" mass=\"{:.17g}\" diaginertia=\"{}\"/>"
        "<joint type=\"hinge\" pos=\"{}\" axis=\"{}\"/>",
        name(rod), text(r.centre - linkage.centre(parent)), r.mass, text(r.inertia), text(h.point - r.centre),
        text(h.axis));
    for (const std::size_t k : children[static_cast<std::size_t>(rod + 1)]) self(self, k);
    out += "</body>";
  };
  for (const std::size_t k : children[0]) add(add, k);
  out += "</worldbody><equality>";
  for (const int hinge : tree.closing) {
    const Linkage::Hinge& h = linkage.hinges[static_cast<std::size_t>(hinge)];
    const int first = h.body1 == Linkage::kGround ? h.body2 : h.body1;
    const std::string second = h.body1 == Linkage::kGround ? "world" : name(h.body2);
    const auto connect = [&](const Vector3d& at) {
      out +=
          fmt::format("<connect body1=\"{}\" body2=\"{}\" anchor=\"{}\" solref=\"0.002 1\" solimp=\"0.9999 0.9999\"/>",
                      name(first), second, text(at - linkage.centre(first)));
    };
    if (linkage.planar()) {
      connect(h.point);
    } else {
      connect(h.point - 0.5 * h.axis);
      connect(h.point + 0.5 * h.axis);
    }
  }
  return out + "</equality></mujoco>";
}

class Mujoco final : public Peer {
 public:
  explicit Mujoco(const Linkage& linkage) : gravity_(linkage.gravity) {
    const std::string xml = model_text(linkage);
    const auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    mj_makeEmptyFileVFS(files.get(), "linkage.xml", static_cast<int>(xml.size()));
    std::memcpy(files->filedata[0], xml.data(), xml.size());
    char error[500] = "";
    model_.reset(mj_loadXML("linkage.xml", files.get(), error, sizeof error));
    mj_deleteVFS(files.get());
    if (!model_) throw std::runtime_error(error);
    data_.reset(mj_makeData(model_.get()));
    const SpanningTree tree = spanning_tree(linkage);
    bodies_.resize(linkage.rods.size());
    rates_.resize(linkage.rods.size());
    for (const auto& [parent, rod, hinge] : tree.branches) {
      const int body = mj_name2id(model_.get(), mjOBJ_BODY, name(rod).c_str());
      bodies_[static_cast<std::size_t>(rod)] = body;
      const int joint = model_->jnt_dofadr[model_->body_jntadr[body]];
      rates_[static_cast<std::size_t>(joint)] =
          linkage.hinges[static_cast<std::size_t>(hinge)].axis.dot(linkage.rod(rod).omega - linkage.omega(parent));
    }
    reset();
  }

  void right_hand_side() override { mj_forward(model_.get(), data_.get()); }
  Vector3d acceleration(int rod) override {
    mj_rnePostConstraint(model_.get(), data_.get());
    mjtNum a[6];
    mj_objectAcceleration(model_.get(), data_.get(), mjOBJ_BODY, bodies_[static_cast<std::size_t>(rod)], a, 0);
    return Vector3d(a[3], a[4], a[5]) + gravity_;
  }

  int levels() const override { return 5; }
  std::string level_name(int level) const override { return fmt::format("RK4, steps of {:g} ms", 1e3 * step(level)); }
  std::optional<std::vector<Eigen::Matrix3Xd>> run(int level, const std::vector<double>& times,
                                                   double most_seconds) override {
    const double h = step(level);
    model_->opt.timestep = h;
    for (int i = 0; i < model_->neq; ++i) model_->eq_solref[mjNREF * i] = 2 * h;  // as stiff as the step allows
    reset();
    const ThreadClock clock;
    std::vector<Eigen::Matrix3Xd> centres;
    for (const double t : times) {
      while (data_->time < t - 0.5 * h) {
        mj_step(model_.get(), data_.get());
        if (clock.seconds() > most_seconds) return std::nullopt;
      }
      mj_kinematics(model_.get(), data_.get());
      Eigen::Matrix3Xd now(3, static_cast<Eigen::Index>(bodies_.size()));
      for (std::size_t i = 0; i < bodies_.size(); ++i)
        now.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Vector3d>(data_->xipos + 3 * bodies_[i]);
      centres.push_back(std::move(now));
    }
    return centres;
  }

 private:
  static double step(int level) { return std::vector{2e-3, 1e-3, 5e-4, 2e-4, 1e-4}[static_cast<std::size_t>(level)]; }
  void reset() {
    mj_resetData(model_.get(), data_.get());
    for (std::size_t i = 0; i < rates_.size(); ++i) data_->qvel[i] = rates_[i];
  }
  struct Deleter {
    void operator()(mjModel* m) const { mj_deleteModel(m); }
    void operator()(mjData* d) const { mj_deleteData(d); }
  };
  Vector3d gravity_;
  std::unique_ptr<mjModel, Deleter> model_;
  std::unique_ptr<mjData, Deleter> data_;
  std::vector<int> bodies_;
  std::vector<double> rates_;
};

}  // namespace

std::unique_ptr<Peer> mujoco_peer(const Linkage& linkage) {
  std::vector<int> depth(linkage.rods.size() + 1, 0);
  for (const auto& [parent, rod, hinge] : spanning_tree(linkage).branches) {
    int& here = depth[static_cast<std::size_t>(rod + 1)];
    here = depth[static_cast<std::size_t>(parent + 1)] + 1;
    if (here > kDeepest) return nullptr;
  }
  return std::make_unique<Mujoco>(linkage);
}

}  // namespace mbsopt::bench
