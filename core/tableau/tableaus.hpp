// All Runge-Kutta methods, and each by its name.
#pragma once

#include <span>
#include <string_view>

#include "core/tableau/method.hpp"

namespace mbsopt {

// All methods: the explicit ones, then the implicit ones, each by rising order.
std::span<const Method> runge_kutta_methods();
std::span<const Method> explicit_methods();
std::span<const Method> implicit_methods();
// Finds a method by name; null if there is none.
const Method* runge_kutta_method(std::string_view name);
const Method* explicit_method(std::string_view name);

}  // namespace mbsopt
