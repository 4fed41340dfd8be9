#include "core/mechanism/mechanism.hpp"

#include <algorithm>

#include "core/body/state_layout.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {

Mechanism::Mechanism(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                     std::vector<std::shared_ptr<const UserForce>> user_forces, std::shared_ptr<ScenePrograms> programs)
    : data_(std::make_shared<const MechanismData>(
          compile(scene, rho, active, std::move(user_forces), std::move(programs)))) {}

int Mechanism::bodies() const { return data_->n; }
int Mechanism::states() const { return static_cast<int>(StateLayout{data_->n}.size()); }
int Mechanism::parameters() const { return static_cast<int>(data_->rho.size()); }
const Eigen::VectorXd& Mechanism::rho() const { return data_->rho; }
int Mechanism::sensors() const { return static_cast<int>(data_->sensors.size()); }

int Mechanism::sensor(const std::string& name) const {
  const auto found = std::find(data_->sensor_names.begin(), data_->sensor_names.end(), name);
  return found == data_->sensor_names.end() ? -1 : static_cast<int>(found - data_->sensor_names.begin());
}

double Mechanism::sensor_value(int sensor, const StatePoint& at) const {
  return data_->sensors[static_cast<std::size_t>(sensor)]->evaluate(*data_, at, nullptr);
}

double Mechanism::add_sensor_gradient(int sensor, const StatePoint& at, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                                      Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  const double value = add_unfolded_gradient(sensor, at, scale, y_bar, rho_bar);
  if (reads_motion(sensor)) at.motion->fold_bar(at, y_bar, rho_bar);
  return value;
}

bool Mechanism::reads_motion(int sensor) const {
  return data_->sensors[static_cast<std::size_t>(sensor)]->reads == Reads::motion;
}

double Mechanism::add_unfolded_gradient(int sensor, const StatePoint& at, double scale,
                                        Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
  SensorGradient to{*data_, scale, y_bar, rho_bar};
  return data_->sensors[static_cast<std::size_t>(sensor)]->evaluate(*data_, at, &to);
}

Eigen::Matrix<double, 13, 1> body_row(const Mechanism& mechanism, int body, const StatePoint& at) {
  const Frame b = body_at(at.y, body + 1);
  const Vector3d to_origin = -mechanism.data().bodies[static_cast<std::size_t>(body + 1)].com;
  Eigen::Matrix<double, 13, 1> row;
  row << b.point(to_origin), b.p, b.point_dot(to_origin), b.A * b.omega();
  return row;
}

}  // namespace mbsopt
