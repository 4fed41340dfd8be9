// Starter files of the command new: what a first problem of each kind looks like.
#include "app/command/starter_files.hpp"

namespace mbsopt {
namespace {

constexpr std::string_view kPendulum = R"({
  // A rod that swings from the horizontal. Comments like this one are allowed in problem files.
  //   mbsopt simulate pendulum.json      the motion: out/pendulum/report.html
  //   mbsopt gradient pendulum.json      the objective and its derivatives in L and m
  //   mbsopt design pendulum.json        the length L with which the rod hangs down after 0.4 s
  "format": 1,
  "name": "pendulum",
  "gravity": [0, -9.81, 0],
  "parameters": {
    // what may be changed; any number of the model may be an expression of these
    "L": {"value": 0.5, "lower": 0.2, "upper": 1, "unit": "m"},
    "m": {"value": 2, "lower": 0.5, "upper": 5, "unit": "kg"}
  },
  "bodies": [
    // the origin of the rod's axes is its upper end; its position is a guess, which joints and conditions correct
    {"name": "rod", "mass": "m", "com": ["L/2", 0, 0], "inertia": [1e-4, "m*L^2/12", "m*L^2/12"],
     "points": {"tip": ["L", 0, 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.01}]}
  ],
  "joints": [
    {"name": "pivot", "type": "revolute", "body1": "ground", "body2": "rod", "point1": [0, 0, 0], "point2": "O",
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "forces": [{"name": "bearing", "type": "rsda", "joint": "pivot", "damping": "0.01 [N m s/rad]"}],
  "sensors": {
    // what can be measured: columns of trajectory.csv, and names in objectives
    "angle": {"quantity": "angle", "joint": "pivot"},
    "tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"}
  },
  "initial": {"conditions": [{"sensor": "angle", "value": 0, "rate": 0}]},
  "simulation": {"end_time": 0.4},
  "objectives": {
    // terminal: at the end time; running: integrated over time
    "hangs": {"terminal": "(angle + pi/2)^2"}
  },
  "design": {"minimize": "hangs", "variables": ["L"]}
}
)";

constexpr std::string_view kFourBar = R"({
  // A crank-rocker that a motor turns at constant speed. Its joints and its drive leave nothing free.
  //   mbsopt kinematics four-bar.json    positions, joint forces and motor torque: out/four-bar/report.html
  //   mbsopt gradient four-bar.json      the objectives and their derivatives in all parameters
  "format": 1,
  "name": "four-bar",
  "gravity": [0, -9.81, 0],
  "parameters": {
    "crank": {"value": 0.3, "unit": "m"},
    "coupler": {"value": 0.9, "unit": "m"},
    "rocker": {"value": 0.7, "unit": "m"},
    "base": {"value": 0.8, "unit": "m"},
    "speed": {"value": 6, "unit": "rad/s"}
  },
  "bodies": [
    // positions and orientations need only be near those in which the loop closes
    {"name": "crank_bar", "mass": 1, "com": ["crank/2", 0, 0],
     "inertia": [1e-3, "1 [kg]*crank^2/12", "1 [kg]*crank^2/12"],
     "points": {"tip": ["crank", 0, 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.02}]},
    {"name": "coupler_bar", "mass": 2, "com": ["coupler/2", 0, 0],
     "inertia": [1e-3, "2 [kg]*coupler^2/12", "2 [kg]*coupler^2/12"],
     "position": ["crank", 0, 0], "orientation": {"axis": [0, 0, 1], "angle": "50 [deg]"},
     "points": {"tip": ["coupler", 0, 0], "pen": ["coupler/2", 0.25, 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.02}]},
    {"name": "rocker_bar", "mass": 1.5, "com": ["rocker/2", 0, 0],
     "inertia": [1e-3, "1.5 [kg]*rocker^2/12", "1.5 [kg]*rocker^2/12"],
     "position": ["base", 0, 0], "orientation": {"axis": [0, 0, 1], "angle": "85 [deg]"},
     "points": {"tip": ["rocker", 0, 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.02}]}
  ],
  "joints": [
    // body1 is the ground where it is left out, and a point is the origin of its body
    {"name": "A", "type": "revolute", "body2": "crank_bar", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "B", "type": "revolute", "body1": "crank_bar", "body2": "coupler_bar", "point1": "tip",
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "C", "type": "revolute", "body1": "coupler_bar", "body2": "rocker_bar", "point1": "tip", "point2": "tip",
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "D", "type": "revolute", "body2": "rocker_bar", "point1": ["base", 0, 0],
     "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "drives": [{"name": "motor", "type": "angle", "joint": "A", "law": "speed*t"}],
  "sensors": {
    "pen_x": {"quantity": "position", "body": "coupler_bar", "point": "pen", "component": "x"},
    "pen_y": {"quantity": "position", "body": "coupler_bar", "point": "pen", "component": "y"},
    "rocker_angle": {"quantity": "angle", "joint": "D"},
    "motor_torque": {"quantity": "drive_force", "drive": "motor"}
  },
  "simulation": {"end_time": 1.0471975511965976},  // one turn: 2 pi/speed
  "objectives": {
    "rms_torque": {"rms_of": "motor_torque"},
    "height": {"running": "pen_y"}
  }
}
)";

constexpr std::string_view kSuspension = R"({
  // A quarter of a car drives onto a kerb of 5 cm. Spring and damper are designed for comfort, the integral of the
  // body's squared acceleration, while the suspension's travel stays within 3.5 cm.
  //   mbsopt simulate suspension.json    the motion: out/suspension/report.html
  //   mbsopt design suspension.json      the best k and c: out/suspension/optimized.json
  "format": 1,
  "name": "suspension",
  "gravity": [0, 0, 0],  // heights are those above static equilibrium
  "parameters": {
    "k": {"value": 30000, "lower": 2000, "upper": 100000, "scale": "log", "unit": "N/m"},
    "c": {"value": 3000, "lower": 200, "upper": 10000, "scale": "log", "unit": "N s/m"}
  },
  "definitions": {"kerb": "5 [cm]", "strut_at_rest": "0.5 [m]"},
  "bodies": [
    {"name": "wheel", "mass": 40, "inertia": [1, 1, 1], "position": [0, 0, 0.3],
     "shape": [{"type": "sphere", "from": "O", "radius": 0.1}]},
    {"name": "body", "mass": 300, "inertia": [10, 10, 10], "position": [0, 0, 0.8],
     "shape": [{"type": "sphere", "from": "O", "radius": 0.2}]}
  ],
  "joints": [
    {"name": "wheel_guide", "type": "translational", "body2": "wheel", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "body_guide", "type": "translational", "body2": "body", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}
  ],
  "forces": [
    // the tyre stands on the ground, which the kerb has lifted
    {"name": "strut", "type": "tsda", "body1": "wheel", "body2": "body", "stiffness": "k", "damping": "c",
     "free_length": "strut_at_rest"},
    {"name": "tyre", "type": "tsda", "body1": "ground", "body2": "wheel", "stiffness": 180000,
     "free_length": "0.3 + kerb"}
  ],
  "sensors": {
    "acceleration": {"quantity": "acceleration", "body": "body", "component": "z"},
    "strut_length": {"quantity": "distance", "body1": "wheel", "body2": "body"},
    // an expression of other sensors is a sensor, too
    "compression": {"quantity": "expression", "value": "strut_at_rest - strut_length"}
  },
  "simulation": {"end_time": 3},
  "objectives": {
    "comfort": {"running": "acceleration^2"},
    "travel": {"maximum_of": "compression", "sharpness": 1000}
  },
  "design": {
    "minimize": "comfort",
    "subject_to": [{"objective": "travel", "upper": 0.035}],
    "variables": ["k", "c"]
  }
}
)";

constexpr std::string_view kIdentify = R"({
  // A mass on a spring and a damper is released; its stiffness and damping are fitted to the measured displacement in
  // identify.csv. The data were made with k = 50 N/m, c = 0.8 N s/m and noise of 1 mm.
  //   mbsopt identify identify.json      values, confidence intervals, residuals: out/identify/report.html
  "format": 1,
  "name": "identify",
  "gravity": [0, 0, 0],
  "parameters": {
    "k": {"value": 30, "lower": 1, "upper": 500, "scale": "log", "unit": "N/m"},
    "c": {"value": 0.3, "lower": 0, "upper": 10, "unit": "N s/m"},
    "x0": {"value": 0.08, "unit": "m"}
  },
  "bodies": [{"name": "cart", "mass": 1.2, "inertia": [0.01, 0.01, 0.01]}],
  "joints": [
    {"name": "rail", "type": "translational", "body2": "cart", "axis1": [1, 0, 0], "axis2": [1, 0, 0]}
  ],
  "forces": [
    // the spring is 1 m long where the displacement is 0
    {"name": "spring", "type": "tsda", "body1": "ground", "body2": "cart", "point1": [-1, 0, 0], "point2": "O",
     "stiffness": "k", "damping": "c", "free_length": "1 [m]"}
  ],
  "sensors": {"x": {"quantity": "displacement", "joint": "rail"}},
  "initial": {"conditions": [{"sensor": "x", "value": "x0", "rate": 0}]},
  "simulation": {"end_time": 2.4},
  "identification": {
    "variables": ["k", "c"],
    "experiments": [
      // free: what differs from experiment to experiment; sigma: standard deviation of the noise
      {"name": "release", "data": "identify.csv", "time": "t",
       "channels": [{"column": "x", "sensor": "x", "sigma": 0.001}],
       "free": ["x0"]}
    ]
  }
}
)";

constexpr std::string_view kIdentifyData = R"(t,x
0.00,0.0997
0.04,0.0972
0.08,0.0870
0.12,0.0719
0.16,0.0520
0.20,0.0304
0.24,0.0081
0.28,-0.0161
0.32,-0.0373
0.36,-0.0568
0.40,-0.0712
0.44,-0.0808
0.48,-0.0866
0.52,-0.0823
0.56,-0.0755
0.60,-0.0635
0.64,-0.0499
0.68,-0.0314
0.72,-0.0105
0.76,0.0100
0.80,0.0297
0.84,0.0458
0.88,0.0594
0.92,0.0671
0.96,0.0722
1.00,0.0717
1.04,0.0654
1.08,0.0583
1.12,0.0442
1.16,0.0294
1.20,0.0107
1.24,-0.0066
1.28,-0.0225
1.32,-0.0367
1.36,-0.0477
1.40,-0.0563
1.44,-0.0612
1.48,-0.0620
1.52,-0.0577
1.56,-0.0486
1.60,-0.0401
1.64,-0.0263
1.68,-0.0119
1.72,0.0008
1.76,0.0164
1.80,0.0303
1.84,0.0374
1.88,0.0467
1.92,0.0512
1.96,0.0513
2.00,0.0500
2.04,0.0436
2.08,0.0338
2.12,0.0255
2.16,0.0134
2.20,0.0013
2.24,-0.0103
2.28,-0.0225
2.32,-0.0319
2.36,-0.0403
2.40,-0.0425
)";

constexpr StarterFile kFiles[] = {
    {"pendulum", "pendulum.json", kPendulum},       {"four-bar", "four-bar.json", kFourBar},
    {"suspension", "suspension.json", kSuspension}, {"identify", "identify.json", kIdentify},
    {"identify", "identify.csv", kIdentifyData},
};

}  // namespace

std::span<const StarterFile> starter_files() { return kFiles; }

}  // namespace mbsopt
