// Calls a user's code, and puts the name of its term before the message of an exception.
//
//   named_throw("forces[1] (drag)", [&] { force.Q(t, q, v, rho, Q); });   // "forces[1] (drag) threw: no table"
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace mbsopt {

template <class F>
decltype(auto) named_throw(const std::string& name, F&& f) {
  try {
    return f();
  } catch (const std::exception& error) {
    throw std::runtime_error(name + " threw: " + error.what());
  } catch (...) {
    throw std::runtime_error(name + " threw what is no std::exception");
  }
}

}  // namespace mbsopt
