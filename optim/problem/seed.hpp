// Seeds of random numbers. If a seed is not given, it is drawn once and reported, so that any run can be repeated.
#pragma once

namespace mbsopt::inline optim {

long drawn_seed();  // 0 to 2^31 - 1, from the system

}  // namespace mbsopt::inline optim
