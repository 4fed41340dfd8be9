// The parts of a program that depend on time and parameters alone, and the instants at which they change.
//
//   for (const Program& f : time_parts_of(law, parameters, time))      // of x*exp(-((t - tp)/eps)^2): the exponential
//     const std::vector<double> instants = pieces_of(f, time, inputs, start, end);
//
// Each term of a part is like a polynomial of degree 3 between two instants, so that quadratures resolve it. No pulse
// hides between samples: its range by intervals must agree with the range of the samples. Otherwise the search halves
// the piece. So it finds pulses, steps and kinks of any width, with some tens of pieces around each.
#pragma once

#include <vector>

#include "core/expression/program.hpp"

namespace mbsopt {

// The inputs below `parameters` and the input `time` are those of the parts; others are the motion. Functions through
// samples at instants a t + b are left out: their samples are known (program_switches.hpp). So is what is linear.
std::vector<Program> time_parts_of(const Program& program, int parameters, int time);

// x: the inputs of the part; that of time is overwritten. Returns start, the instants between, end.
std::vector<double> pieces_of(const Program& part, int time, std::vector<double> x, double start, double end);
// The same as parts of the way, 0 to 1, along which all inputs change evenly.
std::vector<double> pieces_between(const Program& part, const std::vector<double>& from, const std::vector<double>& to);
// The instants, of those pieces, at which the part jumps.
std::vector<double> jumps_of(const Program& part, int time, std::vector<double> x, const std::vector<double>& pieces);

}  // namespace mbsopt
