// Owners of SUNDIALS' objects. Only the cvodes_*.cpp files include this header, directly or through their own headers.
// Every object belongs to a context, which must outlive it.
#pragma once

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>

#include <Eigen/Core>
#include <exception>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/linear/fixed_size.hpp"

namespace mbsopt::cvodes {

// Releases each kind of object.
struct Release {
  void operator()(SUNContext context) const { SUNContext_Free(&context); }
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
  void operator()(void* memory) const { CVodeFree(&memory); }  // of one integrator
  void operator()(SUNNonlinearSolver solver) const { SUNNonlinSolFree(solver); }
  void operator()(SUNLinearSolver solver) const { SUNLinSolFreeEmpty(solver); }
  void operator()(SUNMatrix matrix) const { SUNMatFreeEmpty(matrix); }
};
template <class Object>
using Owner = std::unique_ptr<std::remove_pointer_t<Object>, Release>;

class Context {
 public:
  Context() {
    SUNContext context = nullptr;
    if (SUNContext_Create(nullptr, &context) != 0) throw std::bad_alloc();
    context_.reset(context);
  }
  operator SUNContext() const { return context_.get(); }

 private:
  Owner<SUNContext> context_;
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
    values(*this).setZero();
  }
  operator N_Vector() const { return vector_.get(); }
  Eigen::Map<Eigen::VectorXd> operator*() const { return values(*this); }

 private:
  Owner<N_Vector> vector_;
};

// An array of vectors of the same size, as SUNDIALS' functions of sensitivities require.
class VectorArray {
 public:
  VectorArray(int count, Eigen::Index size, const Context& context) {
    for (int i = 0; i < count; ++i) handles_.push_back(vectors_.emplace_back(size, context));
  }
  operator N_Vector*() { return handles_.data(); }
  Eigen::Map<Eigen::VectorXd> at(int i) const { return *vectors_[mbsopt::at(i)]; }

 private:
  std::vector<Vector> vectors_;
  std::vector<N_Vector> handles_;
};

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
