// An exception of a user's cost or force must not unwind through CVODES, which is C. A callback keeps the exception and
// reports a failure; the caller of CVODES then throws it.
#pragma once

#include <exception>
#include <utility>

namespace mbsopt::cvodes {

class Thrown {
 public:
  template <class Callback>
  int keep(Callback&& callback) noexcept {
    constexpr int kGiveUp = -1;
    try {
      return callback();
    } catch (...) {
      thrown_ = std::current_exception();
      return kGiveUp;
    }
  }
  void throw_on() {
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  }

 private:
  std::exception_ptr thrown_;
};

}  // namespace mbsopt::cvodes
