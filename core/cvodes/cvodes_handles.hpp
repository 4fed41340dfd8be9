// Owners of SUNDIALS' objects. Only the cvodes_*.cpp files include this header, directly or through their own headers.
// Every object belongs to a context, which must outlive it.
#pragma once

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>

#include <Eigen/Core>
#include <exception>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace mbsopt::cvodes {

class Context {
 public:
  Context() {
    if (SUNContext_Create(nullptr, &context_) != 0) throw std::bad_alloc();
  }
  ~Context() { SUNContext_Free(&context_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  operator SUNContext() const { return context_; }

 private:
  SUNContext context_ = nullptr;
};

// The numbers of a SUNDIALS vector.
inline Eigen::Map<Eigen::VectorXd> values(N_Vector v) { return {N_VGetArrayPointer(v), N_VGetLength(v)}; }

// CVODES 6.4.1 reads numbers of its copies before it has set them. It reads those of quadratures of sensitivities when
// it considers a higher order.
inline N_Vector clone_of_zeros(N_Vector v) {
  const N_Vector clone = N_VClone_Serial(v);
  if (clone) values(clone).setZero();
  return clone;
}

class Vector {
 public:
  Vector(Eigen::Index size, const Context& context) : vector_(N_VNew_Serial(size, context)) {
    if (!vector_) throw std::bad_alloc();
    vector_->ops->nvclone = &clone_of_zeros;
    values(vector_).setZero();
  }
  Vector(Vector&& other) noexcept : vector_(std::exchange(other.vector_, nullptr)) {}
  Vector& operator=(Vector&&) = delete;
  ~Vector() { N_VDestroy(vector_); }
  operator N_Vector() const { return vector_; }
  Eigen::Map<Eigen::VectorXd> operator*() const { return values(vector_); }

 private:
  N_Vector vector_;
};

// An array of vectors of the same size, as SUNDIALS' functions of sensitivities require.
class VectorArray {
 public:
  VectorArray(int count, Eigen::Index size, const Context& context)
      : count_(count), vectors_(N_VCloneVectorArray(count, Vector(size, context))) {
    if (!vectors_) throw std::bad_alloc();
  }
  VectorArray(const VectorArray&) = delete;
  VectorArray& operator=(const VectorArray&) = delete;
  ~VectorArray() { N_VDestroyVectorArray(vectors_, count_); }
  operator N_Vector*() const { return vectors_; }
  Eigen::Map<Eigen::VectorXd> at(int i) const { return values(vectors_[i]); }

 private:
  int count_;
  N_Vector* vectors_;
};

struct FreeMemory {
  void operator()(void* memory) const { CVodeFree(&memory); }
};
using Memory = std::unique_ptr<void, FreeMemory>;  // of one integrator

struct FreeNonlinearSolver {
  void operator()(SUNNonlinearSolver solver) const { SUNNonlinSolFree(solver); }
};
using NonlinearSolver = std::unique_ptr<std::remove_pointer_t<SUNNonlinearSolver>, FreeNonlinearSolver>;

// An exception of a user's cost or force must not unwind through CVODES, which is C. A callback keeps the exception and
// reports a failure; the caller of CVODES then throws it.
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
