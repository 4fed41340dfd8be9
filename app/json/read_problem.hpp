// Reads a problem from its file. Reading checks everything: the returned problem is complete and consistent.
//
//   Problem problem = read_problem("five_bar/design.json", {"parameters.k1.value=120"});
//
//   ReadOptions options;                                               // forces in C++ that the file calls by name
//   options.terms.add_force("drag", {"c"}, std::make_shared<Drag>());
//   Problem with_drag = read_problem("pendulum.json", {}, nullptr, options);
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/json/input_error.hpp"
#include "app/json/read_options.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

// Throws InputError with all faults. Each of set_overrides is "path=value". `warnings` receives remarks that are no
// errors.
Problem read_problem(const std::filesystem::path& file, const std::vector<std::string>& set_overrides = {},
                     std::vector<std::string>* warnings = nullptr, const ReadOptions& options = {});

// Reads the same from a text. `name` names the file in findings, and its folder is searched for data files.
Problem read_problem_text(const std::string& text, const std::filesystem::path& name,
                          const std::vector<std::string>& set_overrides = {},
                          std::vector<std::string>* warnings = nullptr, const ReadOptions& options = {});

}  // namespace mbsopt::inline app
