#include "app/command/starter_files.hpp"

namespace mbsopt {
namespace {

constexpr StarterFile kPendulum[] = {
    {"pendulum.json", R"json({
  // A pendulum: the smallest problem that simulates, has an objective and its exact gradient.
  //   mbsopt validate pendulum.json     checks the file, counts degrees of freedom
  //   mbsopt simulate pendulum.json     writes out/pendulum/trajectory.csv and report.html
  //   mbsopt gradient pendulum.json     d(objective)/d(parameter)
  //   mbsopt check pendulum.json        compares these gradients with differences
  // Numbers are SI and radians. A text is an expression: "m*L^2/12", "40 [deg]".
  "format": 1,
  "name": "pendulum",  // results go to out/pendulum/
  "gravity": [0, -9.81, 0],  // y points upwards
  "parameters": {  // what may be changed, and with respect to what gradients are computed
    "L": {"value": 0.5, "lower": 0.1, "upper": 1, "unit": "m"},
    "m": {"value": 0.8, "unit": "kg"},
    "damping": {"value": 0.01, "lower": 0, "upper": 0.1, "unit": "N m s"},
    "start": {"value": "40 [deg]", "unit": "rad"}
  },
  "bodies": [
    // com: the centre of mass in the body's axes; inertia: xx, yy, zz about it.
    {"name": "rod", "mass": "m", "com": [0, "-L/2", 0], "inertia": ["m*L^2/12", 1e-5, "m*L^2/12"],
     "points": {"tip": [0, "-L", 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.01}]}
  ],
  "joints": [
    // body1 is the ground where it is absent. The points are "O", the origin of each body, where they are absent.
    {"name": "pivot", "type": "revolute", "body2": "rod", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "forces": [{"name": "bearing", "type": "rsda", "joint": "pivot", "damping": "damping"}],
  // The start: positions in "bodies" are guesses, a condition is met exactly.
  "initial": {"conditions": [{"sensor": "theta", "value": "start", "rate": 0}]},
  "sensors": {  // columns of trajectory.csv, and names for objectives
    "theta": {"quantity": "angle", "joint": "pivot"},
    "tip_x": {"quantity": "position", "body": "rod", "point": "tip", "component": "x"}
  },
  "simulation": {"start_time": 0, "end_time": 3, "accuracy": "engineering"},
  "objectives": {
    "swing": {"running": "theta^2"},  // integral over time
    "tip_at_end": {"terminal": "tip_x"}  // value at the end
  }
}
)json"},
};

constexpr StarterFile kFourBar[] = {
    {"four-bar.json", R"json({
  // A four-bar whose coupler point is to pass given points at given times while the crank turns steadily.
  //   mbsopt design four-bar.json       finds lengths, pivots and coupler point; writes out/four_bar/optimized.json
  //   mbsopt simulate four-bar.json     only moves the linkage as it is below
  // Change the points in "objectives", then the start values and bounds in "parameters".
  "format": 1,
  "name": "four_bar",
  "gravity": [0, -9.81, 0],
  "parameters": {  // the lengths must let the crank turn: crank + longest < sum of the other two
    "crank": {"value": 0.27, "lower": 0.15, "upper": 0.4, "unit": "m"},
    "coupler": {"value": 0.95, "lower": 0.7, "upper": 1.2, "unit": "m"},
    "rocker": {"value": 0.75, "lower": 0.5, "upper": 1, "unit": "m"},
    "Bx": {"value": 1.05, "lower": 0.8, "upper": 1.3, "unit": "m"},  // the rocker's pivot
    "By": {"value": 0.05, "lower": -0.2, "upper": 0.3, "unit": "m"},
    "Px": {"value": 0.45, "lower": 0.2, "upper": 0.8, "unit": "m"},  // the coupler point, in the coupler's axes
    "Py": {"value": 0.25, "lower": 0, "upper": 0.6, "unit": "m"},
    "phase": {"value": 0.1, "lower": -0.5, "upper": 0.8, "unit": "rad"}  // the crank's angle at the start
  },
  "definitions": {"speed": "6.283185307179586 [rad/s]", "bar": "1.5 [kg/m]"},
  "bodies": [
    // Each bar begins at its origin O and lies along its x axis. Positions and angles are guesses: joints are closed.
    {"name": "crank_bar", "mass": "bar*crank", "com": ["crank/2", 0, 0],
     "inertia": [1e-4, "bar*crank^3/12", "bar*crank^3/12"],
     "orientation": {"axis": [0, 0, 1], "angle": "phase"},
     "points": {"pin": ["crank", 0, 0]}, "shape": [{"type": "rod", "from": "O", "to": "pin", "radius": 0.015}]},
    {"name": "coupler_bar", "mass": "bar*coupler", "com": ["coupler/2", 0, 0],
     "inertia": [1e-4, "bar*coupler^3/12", "bar*coupler^3/12"],
     "position": ["crank*cos(phase)", "crank*sin(phase)", 0], "orientation": {"axis": [0, 0, 1], "angle": 0.93},
     "points": {"pin": ["coupler", 0, 0], "P": ["Px", "Py", 0]},
     "shape": [{"type": "rod", "from": "O", "to": "pin", "radius": 0.015},
               {"type": "rod", "from": "O", "to": "P", "radius": 0.008}]},
    {"name": "rocker_bar", "mass": "bar*rocker", "com": ["rocker/2", 0, 0],
     "inertia": [1e-4, "bar*rocker^3/12", "bar*rocker^3/12"],
     "position": ["Bx", "By", 0], "orientation": {"axis": [0, 0, 1], "angle": 1.8},
     "points": {"pin": ["rocker", 0, 0]}, "shape": [{"type": "rod", "from": "O", "to": "pin", "radius": 0.015}]}
  ],
  "joints": [
    {"name": "A", "type": "revolute", "body2": "crank_bar", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "C", "type": "revolute", "body1": "crank_bar", "body2": "coupler_bar", "point1": "pin",
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "D", "type": "revolute", "body1": "coupler_bar", "body2": "rocker_bar", "point1": "pin", "point2": "pin",
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "B", "type": "revolute", "body2": "rocker_bar", "point1": ["Bx", "By", 0],
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "drives": [{"name": "motor", "type": "angle", "joint": "A", "law": "phase + speed*t"}],
  "sensors": {
    "x": {"quantity": "position", "body": "coupler_bar", "point": "P", "component": "x"},
    "y": {"quantity": "position", "body": "coupler_bar", "point": "P", "component": "y"}
  },
  "simulation": {"start_time": 0, "end_time": 0.7, "output_step": 0.005, "accuracy": "engineering"},
  "objectives": {
    "path": {"samples": [  // squared distances; the factor gives the optimiser numbers of the size of 1
      {"time": 0, "value": "1e3*((x - 0.354)^2 + (y - 0.640)^2)"},
      {"time": 0.1, "value": "1e3*((x - 0.399)^2 + (y - 0.770)^2)"},
      {"time": 0.2, "value": "1e3*((x - 0.302)^2 + (y - 0.816)^2)"},
      {"time": 0.3, "value": "1e3*((x - 0.143)^2 + (y - 0.767)^2)"},
      {"time": 0.4, "value": "1e3*((x - 0.001)^2 + (y - 0.639)^2)"},
      {"time": 0.5, "value": "1e3*((x + 0.081)^2 + (y - 0.483)^2)"},
      {"time": 0.6, "value": "1e3*((x + 0.095)^2 + (y - 0.352)^2)"}]},
    "length": {"parameters_only": "crank + coupler + rocker"}
  },
  "design": {
    "minimize": "path",
    "subject_to": [{"objective": "length", "upper": 2.2}],
    "variables": ["crank", "coupler", "rocker", "Bx", "By", "Px", "Py", "phase"],
    "optimizer": {"hessian": "gauss_newton"}  // "path" is a sum of squares
  }
}
)json"},
};

constexpr StarterFile kSuspension[] = {
    {"suspension.json", R"json({
  // A quarter of a car drives onto a kerb: spring and damper for comfort, with limits on travel and on the tyre's load.
  //   mbsopt design suspension.json     finds k and c; report.html shows the motion before and after
  //   mbsopt simulate suspension.json   the motion with the values below
  // Heights count from static equilibrium, so there is no gravity.
  "format": 1,
  "name": "suspension",
  "gravity": [0, 0, 0],
  "parameters": {  // "log": the optimiser changes them by factors
    "k": {"value": 30000, "lower": 2000, "upper": 100000, "scale": "log", "unit": "N/m"},
    "c": {"value": 3000, "lower": 200, "upper": 10000, "scale": "log", "unit": "N s/m"}
  },
  "definitions": {"kerb": "5 [cm]"},
  "bodies": [
    {"name": "wheel", "mass": 40, "inertia": [1, 1, 1], "position": [0, 0, 0.3],
     "shape": [{"type": "sphere", "from": "O", "radius": 0.1}]},
    {"name": "body", "mass": 300, "inertia": [10, 10, 10], "position": [0, 0, 0.8],
     "shape": [{"type": "sphere", "from": "O", "radius": 0.2}]}
  ],
  "joints": [  // both only move up and down
    {"name": "wheel_guide", "type": "translational", "body2": "wheel", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "body_guide", "type": "translational", "body2": "body", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "forces": [
    {"name": "strut", "type": "tsda", "body1": "wheel", "body2": "body", "stiffness": "k", "damping": "c",
     "free_length": 0.5},
    // The kerb lifts the foot of the tyre at once. A "law" of l, ldot and t would replace these coefficients.
    {"name": "tyre", "type": "tsda", "body2": "wheel", "stiffness": 180000, "free_length": "0.3 + kerb"}
  ],
  "sensors": {
    "acceleration": {"quantity": "acceleration", "body": "body", "component": "z"},
    "strut_length": {"quantity": "distance", "body1": "wheel", "body2": "body"},
    "tyre_length": {"quantity": "distance", "body1": "ground", "body2": "wheel"}
  },
  "simulation": {"start_time": 0, "end_time": 3, "output_step": 0.01,
                 "integrator": {"type": "dopri853", "rtol": 1e-8, "atol": 1e-10}},
  "objectives": {
    "comfort": {"running": "acceleration^2"},
    "grip": {"running": "1e4*(tyre_length - 0.3 - kerb)^2"},
    // The largest compression [m], made smooth; "design" prints the true one beside it.
    "travel": {"maximum_of": "0.5 - strut_length", "sharpness": 2000}
  },
  "design": {
    "minimize": "comfort",
    "subject_to": [{"objective": "grip", "upper": 0.41}, {"objective": "travel", "upper": 0.06}],
    "variables": ["k", "c"]
  }
}
)json"},
};

constexpr StarterFile kIdentify[] = {
    {"identify.json", R"json({
  // Inertia and friction of a swinging arm from its measured angle in identify.csv (columns t [s] and theta [rad]).
  //   mbsopt validate identify.json     checks this file and the data
  //   mbsopt identify identify.json     fits; prints values with intervals, writes out/identify/report.html
  // The data were made with J = 0.02 kg m^2, friction 0.004 N m s and noise of 0.01 rad. Replace them by yours.
  "format": 1,
  "name": "identify",
  "gravity": [0, -9.81, 0],
  "parameters": {  // values: where the fit starts
    "J": {"value": 0.03, "lower": 0.011, "upper": 0.1, "unit": "kg m^2"},  // about the pivot
    "friction": {"value": 0.001, "lower": 0, "upper": 0.1, "unit": "N m s"},
    "theta0": {"value": 0.8, "unit": "rad"}
  },
  "definitions": {"m": "0.5 [kg]", "a": "0.15 [m]"},  // known: the swing tells only m g a/J and friction/J
  "bodies": [
    {"name": "arm", "mass": "m", "com": [0, "-a", 0], "inertia": ["J - m*a^2", 1e-4, "J - m*a^2"],
     "points": {"tip": [0, "-2*a", 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.01}]}
  ],
  "joints": [{"name": "pivot", "type": "revolute", "body2": "arm", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
  "forces": [{"name": "bearing", "type": "rsda", "joint": "pivot", "damping": "friction"}],
  "initial": {"conditions": [{"sensor": "theta", "value": "theta0", "rate": 0}]},
  "sensors": {"theta": {"quantity": "angle", "joint": "pivot"}},
  "simulation": {"start_time": 0, "end_time": 3, "accuracy": "engineering"},
  "identification": {
    "experiments": [
      {"name": "release", "data": "identify.csv", "time": "t",
       // sigma: the noise of the sensor. "free": unknown, and another value in each experiment.
       "channels": [{"column": "theta", "sensor": "theta", "sigma": 0.01}],
       "free": ["theta0"]}
    ],
    "variables": ["J", "friction"]
  }
}
)json"},
    {"identify.csv", R"json(t,theta
0.000,0.8974
0.075,0.8253
0.150,0.5913
0.225,0.2546
0.300,-0.1333
0.375,-0.4775
0.450,-0.7185
0.525,-0.8411
0.600,-0.7971
0.675,-0.6213
0.750,-0.3211
0.825,0.0350
0.900,0.3628
0.975,0.6548
1.050,0.7926
1.125,0.7880
1.200,0.6187
1.275,0.3531
1.350,0.0279
1.425,-0.3040
1.500,-0.5683
1.575,-0.7308
1.650,-0.7465
1.725,-0.6408
1.800,-0.3960
1.875,-0.0853
1.950,0.2273
2.025,0.5229
2.100,0.6814
2.175,0.7288
2.250,0.6179
2.325,0.4072
2.400,0.1238
2.475,-0.1824
2.550,-0.4428
2.625,-0.6230
2.700,-0.6853
2.775,-0.6173
2.850,-0.4255
2.925,-0.1414
3.000,0.1318
)json"},
};

constexpr Starter kStarters[] = {
    {"pendulum", "simulate", kPendulum},
    {"four-bar", "design", kFourBar},
    {"suspension", "design", kSuspension},
    {"identify", "identify", kIdentify},
};

}  // namespace

std::span<const Starter> starters() { return kStarters; }

}  // namespace mbsopt
