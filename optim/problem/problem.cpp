#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

IdentificationSpec::IdentificationSpec() = default;
IdentificationSpec::IdentificationSpec(const IdentificationSpec&) = default;
IdentificationSpec::IdentificationSpec(IdentificationSpec&&) noexcept = default;
IdentificationSpec& IdentificationSpec::operator=(const IdentificationSpec&) = default;
IdentificationSpec& IdentificationSpec::operator=(IdentificationSpec&&) noexcept = default;
IdentificationSpec::~IdentificationSpec() = default;

Problem::Problem() = default;
Problem::Problem(const Problem&) = default;
Problem::Problem(Problem&&) noexcept = default;
Problem& Problem::operator=(const Problem&) = default;
Problem& Problem::operator=(Problem&&) noexcept = default;
Problem::~Problem() = default;

}  // namespace mbsopt::inline optim
