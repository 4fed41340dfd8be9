#include "optim/problem/seed.hpp"

#include <random>

namespace mbsopt::inline optim {

long drawn_seed() {
  std::random_device system;
  return static_cast<long>(system() & 0x7fffffffU);
}

}  // namespace mbsopt::inline optim
