#include "core/mechanism/scene_programs.hpp"

#include "core/scene/signals.hpp"

namespace mbsopt {
namespace {

template <class Table, class Make>
auto found_or_made(Table& table, std::mutex& mutex, const Expression& expression, Make&& make) {
  const std::lock_guard lock(mutex);
  auto& entry = table[&expression.tree()];
  if (!entry.made) entry = {expression, make()};
  return entry.made;
}

}  // namespace

ScenePrograms::ScenePrograms(const Scene& scene) {
  for (const Parameter& p : scene.parameters) symbols_.add_input(p.name);
  for (const Definition& d : scene.definitions) symbols_.add_definition(d.name, d.value);
  add_signals(symbols_, scene);
  symbols_of_time_ = symbols_;
  symbols_of_time_.add_input("t");
}

std::shared_ptr<const Program> ScenePrograms::field(const Expression& field) {
  return found_or_made(fields_, mutex_, field, [&] { return std::make_shared<const Program>(field, symbols_); });
}

std::shared_ptr<const std::array<Program, 3>> ScenePrograms::law(const Expression& law) {
  return found_or_made(laws_, mutex_, law, [&] {
    const int t = symbols_of_time_.input("t");
    const Program f(law, symbols_of_time_), f_t = f.derivative(t);
    return std::make_shared<const std::array<Program, 3>>(std::array<Program, 3>{f, f_t, f_t.derivative(t)});
  });
}

}  // namespace mbsopt
