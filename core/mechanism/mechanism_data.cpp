#include "core/mechanism/mechanism_data.hpp"

#include "core/constraint/constraint.hpp"
#include "core/force/forces.hpp"

namespace mbsopt {

MechanismData::MechanismData() : forces(std::make_shared<Forces>()) {}
MechanismData::MechanismData(const MechanismData&) = default;
MechanismData::MechanismData(MechanismData&&) noexcept = default;
MechanismData::~MechanismData() = default;

}  // namespace mbsopt
