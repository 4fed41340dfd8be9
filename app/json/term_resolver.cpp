#include "app/json/term_resolver.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expression/counted.hpp"
#include "core/expression/did_you_mean.hpp"
#include "core/force/named_throw.hpp"
#include "core/scene/scene_path.hpp"
#include "optim/problem/plugin.hpp"

namespace mbsopt::inline app {
namespace {

std::string last_error() {
  const char* const words = dlerror();
  return words ? words : "unknown error of the loader";
}

template <class Function>
Function* symbol(void* library, const char* name) {
  void* const found = dlsym(library, name);
  if (!found)
    throw std::runtime_error(std::string("is no plug-in of mbsopt: it lacks ") + name +
                             "(), which MBSOPT_PLUGIN of <mbsopt/plugin.hpp> defines");
  return reinterpret_cast<Function*>(found);  // POSIX: dlsym
}

// Adds the terms of a shared library (optim/problem/plugin.hpp). The library stays loaded until the process ends,
// because objects of its classes may live so long. Throws std::runtime_error in words: no such file, no library, no
// plug-in, another version, refused terms, or an exception of its registration.
void load_plugin(const std::filesystem::path& file, NamedTerms& terms) {
  // The path is absolute, because the loader searches the system's folders for plain names.
  const std::filesystem::path path = std::filesystem::absolute(file);
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none))
    throw std::runtime_error("there is no file '" + file.string() + "'; a shared library is expected");
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw std::runtime_error("cannot be loaded: " + last_error());
  const char* const interface = symbol<const char*()>(library, "mbsopt_plugin_interface")();
  if (std::string_view(interface) != kPluginInterface)
    throw std::runtime_error(std::string("was compiled for another program: its interface is '") + interface +
                             "', that of this program is '" + kPluginInterface + "'; compile it anew");
  const auto add_terms = symbol<void(NamedTerms&)>(library, "mbsopt_plugin");
  try {
    add_terms(terms);
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("its registration threw: ") + error.what());
  } catch (...) {
    throw std::runtime_error("its registration threw what is no std::exception");
  }
}

class TermResolver {
 public:
  TermResolver(NamedTerms terms, ProblemSource& source) : terms_(std::move(terms)), source_(source) {}

  void load(std::vector<std::string>& plugins, bool allowed) {
    if (!plugins.empty() && !allowed && !source_.findings.concerns("plugins"))
      source_.add("plugins",
                  "names code that would run inside this program; if you trust the file, allow it by --allow-plugins");
    for (std::size_t i = 0; i < plugins.size(); ++i) {
      plugins[i] = source_.beside(plugins[i]).string();
      if (!allowed) continue;
      try {
        load_plugin(plugins[i], terms_);
      } catch (const std::runtime_error& error) {
        source_.add(child_path("plugins", i), error.what());
      }
    }
  }

  void resolve(Force& force, const std::string& place) {
    auto* const user = std::get_if<UserForceSpec>(&force.kind);
    if (!user) return;
    const NamedForce* const term = find(terms_.forces(), "force", user->force, place + ".force");
    if (!term) return;
    user->term = term->force;
    order(user->parameters, term->parameters, place);
    const std::size_t acts_on =
        named_throw("force '" + user->force + "'", [&] { return term->force->bodies(); }).size();
    if (!user->bodies.empty() && user->bodies.size() != acts_on)
      source_.add(place + ".bodies", "has " + counted(user->bodies.size(), "name") + ", but '" + user->force +
                                         "' acts on " + counted(acts_on, "body", "bodies"));
  }

  void resolve(UserCostSpec& cost, const std::string& place) {
    const NamedCost* const term = find(terms_.costs(), "cost", cost.cost, place + ".cost");
    if (!term) return;
    cost.running = term->running;
    cost.terminal = term->terminal;
    order(cost.parameters, term->parameters, place);
  }

  void resolve(Expression& law, std::optional<SampledLaw>& samples, const std::string& place) {
    if (!samples || samples->function.empty()) return;
    static const Expression t = Expression::parse("t");
    if (const NamedLaw* const term = find(terms_.laws(), "law", samples->function, place + ".user"))
      law = Expression::of_curve(
          std::make_shared<const Curve>([f = term->f, name = "law '" + term->name + "'"](double x, int order) {
            return named_throw(name, [&] { return f(x, order); });
          }),
          samples->argument.value_or(t), term->name);
    samples.reset();
  }

 private:
  // The finding about a plug-in that is not loaded replaces those about its unknown names.
  template <class Term>
  const Term* find(const std::vector<Term>& all, const std::string& what, const std::string& name,
                   const std::string& path) {
    const auto found = std::ranges::find(all, name, &Term::name);
    if (found != all.end()) return &*found;
    if (source_.findings.concerns("plugins") || source_.findings.concerns(path)) return nullptr;
    std::vector<std::string> known;
    for (const Term& term : all) known.push_back(term.name);
    source_.add(path,
                "there is no " + what + " '" + name + "' written in C++" + did_you_mean(name, known) +
                    (known.empty() ? "; neither the program nor its plug-ins have one" : "; known: " + joined(known)));
    return nullptr;
  }

  // Puts the parameters in the order of the term; all of them must be given.
  void order(std::vector<TermParameter>& given, const std::vector<std::string>& wanted, const std::string& place) {
    std::vector<TermParameter> ordered;
    for (const std::string& name : wanted) {
      const auto found = std::ranges::find(given, name, &TermParameter::name);
      if (found != given.end())
        ordered.push_back(*found);
      else
        source_.add(place + ".parameters", "'" + name + "' is missing; expected: " + joined(wanted));
    }
    for (const TermParameter& parameter : given)
      if (std::ranges::find(wanted, parameter.name) == wanted.end())
        source_.add(child_path(place + ".parameters", parameter.name),
                    "is no parameter of the term" + did_you_mean(parameter.name, wanted) +
                        (wanted.empty() ? "; it has none" : "; known: " + joined(wanted)));
    given = std::move(ordered);
  }

  NamedTerms terms_;
  ProblemSource& source_;
};

}  // namespace

void resolve_terms(Problem& problem, const ReadOptions& options, ProblemSource& source) {
  TermResolver resolver(options.terms, source);
  resolver.load(problem.plugins, options.allow_plugins);
  const auto resolve_laws = [&](auto& drives, const std::string& list) {
    for (std::size_t i = 0; i < drives.size(); ++i)
      resolver.resolve(drives[i].law, drives[i].samples, child_path(list, i) + ".law");
  };
  Scene& scene = problem.scene;
  for (std::size_t i = 0; i < scene.forces.size(); ++i) resolver.resolve(scene.forces[i], child_path("forces", i));
  resolve_laws(scene.drives, "drives");
  for (ObjectiveSpec& objective : problem.objectives)
    if (objective.user) resolver.resolve(*objective.user, child_path("objectives", objective.name) + ".user");
  for (std::size_t c = 0; c < problem.cases.size(); ++c)
    resolve_laws(problem.cases[c].drives, child_path("cases", c) + ".drives");
  if (!problem.identification) return;
  for (std::size_t e = 0; e < problem.identification->experiments.size(); ++e)
    resolve_laws(problem.identification->experiments[e].drives,
                 child_path("identification.experiments", e) + ".drives");
}

}  // namespace mbsopt::inline app
