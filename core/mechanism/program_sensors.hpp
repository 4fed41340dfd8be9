// Programs of a mechanism as sensors, which have gradients in the state, the parameters and t.
#pragma once

#include "core/expression/program.hpp"
#include "core/force/force_inputs.hpp"
#include "core/mechanism/sensor_function.hpp"

namespace mbsopt {

// inputs: all parameters, t, all sensors of the scene
SensorPtr expression_sensor(const MechanismData& data, Program program);
// inputs: those of the law of a force, which are all parameters, x, xdot, t
SensorPtr law_sensor(ForcePlace force, Program program);

}  // namespace mbsopt
