// Seeds of random numbers. If a seed is not given, it is drawn once and reported, so that any run can be repeated.
#pragma once

#include <random>

namespace mbsopt::inline optim {

// 0 to 2^31 - 1, from the system
inline long drawn_seed() { return static_cast<long>(std::random_device()() & 0x7fffffffU); }

}  // namespace mbsopt::inline optim
