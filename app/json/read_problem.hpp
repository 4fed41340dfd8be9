// A problem from its file. Reading is the whole check: what is returned is complete and consistent.
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

namespace mbsopt {

// Throws InputError with everything that is wrong. set_overrides: "path=value" each. What deserves a word but is no
// error is appended to `warnings`.
Problem read_problem(const std::filesystem::path& file, const std::vector<std::string>& set_overrides = {},
                     std::vector<std::string>* warnings = nullptr, const ReadOptions& options = {});

// The same from a text; `name` stands for the file in findings, and its folder is where data files are looked for.
Problem read_problem_text(const std::string& text, const std::filesystem::path& name,
                          const std::vector<std::string>& set_overrides = {},
                          std::vector<std::string>* warnings = nullptr, const ReadOptions& options = {});

}  // namespace mbsopt
