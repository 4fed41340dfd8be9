#include "core/mechanism/scene_programs.hpp"

#include <utility>

#include "core/scene/signals.hpp"

namespace mbsopt {
namespace {

// make() returns an expression that keeps `key` alive, and the object made from it.
template <class Table, class Make>
auto found_or_made(Table& table, std::mutex& mutex, const void* key, Make&& make) {
  const std::lock_guard lock(mutex);
  auto& entry = table[key];
  if (!entry.made) {
    auto [expression, made] = make();
    entry = {expression, std::make_shared<const decltype(made)>(std::move(made))};
  }
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
  return found_or_made(fields_, mutex_, &field.tree(), [&] { return std::pair(field, Program(field, symbols_)); });
}

ScenePrograms::Law ScenePrograms::made(const Expression& law) const {
  const int t = symbols_of_time_.input("t");
  const Program f(law, symbols_of_time_), f_t = f.derivative(t);
  return {f, f_t, f_t.derivative(t)};
}

std::shared_ptr<const std::array<Program, 3>> ScenePrograms::law(const Expression& law) {
  return found_or_made(laws_, mutex_, &law.tree(), [&] { return std::pair(law, made(law)); });
}

std::shared_ptr<const std::array<Program, 3>> ScenePrograms::law(const SampledLaw& samples) {
  return found_or_made(laws_, mutex_, samples.curve.get(), [&] {
    const Expression law = expression_of(samples, "samples");
    return std::pair(law, made(law));
  });
}

}  // namespace mbsopt
