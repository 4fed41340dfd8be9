// The content of a problem file with --set applied. It finds the place of a path in the file, also if the file has
// changed since.
//
//   const auto source = read_problem_source("crane.json", {});
//   Problem problem = read_problem(*source);
//   source->placed("drives[0].law: its samples ...")    "crane.json:41:18: drives[0].law: its samples ..."
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/json/findings.hpp"
#include "app/json/node.hpp"
#include "app/json/read_options.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

struct ProblemSource {
  std::filesystem::path file;
  Findings findings;  // of the text, of --set, and of read_problem()
  Node root;

  // The path of a file that the problem names relative to its own folder.
  std::filesystem::path beside(const std::string& name) const { return (file.parent_path() / name).lexically_normal(); }

  // Adds a finding at the value of a path, or at the nearest value around it. finding() makes it without adding it.
  void add(const std::string& path, const std::string& message) { findings.add(nearest(root, path), path, message); }
  Finding finding(const std::string& path, const std::string& message) const {
    return findings.finding(nearest(root, path), path, message);
  }

  // Returns nothing if the words do not begin with a path of the problem.
  std::optional<std::string> placed(const std::string& words) const;
};

// Throws InputError if the file cannot be read, or if its text is not JSON.
std::shared_ptr<ProblemSource> read_problem_source(const std::filesystem::path& file,
                                                   const std::vector<std::string>& set_overrides);
ProblemSource problem_source_of(const std::string& text, const std::filesystem::path& name,
                                const std::vector<std::string>& set_overrides);

// Does the same as the functions of read_problem.hpp.
Problem read_problem(ProblemSource& source, std::vector<std::string>* warnings = nullptr,
                     const ReadOptions& options = {});

}  // namespace mbsopt::inline app
