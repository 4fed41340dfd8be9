// Signals: the data that a run needs beside the expressions that use them.
#include "core/mechanism/compilation.hpp"
#include "core/scene/scene_error.hpp"
#include "core/scene/signals.hpp"

namespace mbsopt {

void compile_signals(Compilation& model) {
  const SimulationSettings& s = model.scene.simulation;
  for (const Signal& signal : model.scene.signals) {
    const std::string where = child_path("signals", signal.name);
    if (!signal.curve) throw SceneError(where + ": has no samples: nothing has read its file");
    const FieldValue delay = model.fields.value(signal.delay, where + ".delay");
    if (const auto why = uncovered(covered_by(*signal.curve, delay.value()), s.start_time, s.end_time))
      throw SceneError(where + ": " + *why);
    if (signal.interpolation == Interpolation::hold && !delay.derivatives().isZero(0))
      throw SceneError(where + ".delay: '" + signal.delay.text() +
                       "' depends on a parameter that is varied, and hold jumps at times that move with it: its "
                       "derivative has no value; take \"interpolation\": \"linear\" or \"spline\"");
    KinkedSignal kinks{signal.curve, delay.value(), {}, signal.curve->degree()};
    if (kinks.order <= 1) kinks.moved_by = Program(signal.delay, model.fields.symbols()).used_inputs();
    model.data.kinks.push_back(std::move(kinks));
  }
}

}  // namespace mbsopt
