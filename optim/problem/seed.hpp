// Seeds of what is random. A seed that is not given is drawn once and told, so that any run can be repeated.
#pragma once

namespace mbsopt {

long drawn_seed();  // 0 to 2^31 - 1, from the system

}  // namespace mbsopt
