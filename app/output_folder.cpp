#include "app/output_folder.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/atomic_file.hpp"

namespace mbsopt {
namespace fs = std::filesystem;
namespace {

constexpr std::array kOutputs{"result.json",   "trajectory.csv", "report.html",  "optimized.json",  "history.csv",
                              "residuals.csv", "profile.csv",    "tradeoff.csv", "recommended.json"};

// A folder's name from a problem's: no separators, no leading dot, no control characters.
std::string folder_name(std::string name) {
  for (char& c : name) {
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20) c = '_';
  }
  if (name.empty() || name.front() == '.') name.insert(name.begin(), '_');
  return name;
}

// The problem and the command that a result.json belongs to; empty where it is not one of ours.
struct StoredRun {
  std::string owner, command;
};

std::string text_at(const nlohmann::json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

StoredRun stored_run(const fs::path& file) {
  std::ifstream in(file);
  const nlohmann::json result = nlohmann::json::parse(in, nullptr, false);
  if (text_at(result, "program") != "mbsopt" || !result.contains("provenance")) return {};
  return {text_at(result.at("provenance"), "input"), text_at(result, "command")};
}

}  // namespace

OutputFolder::OutputFolder(const std::string& requested, const std::string& problem_name,
                           const std::string& problem_file, const std::string& command)
    : path_(requested.empty() ? fs::path("out") / folder_name(problem_name) : fs::path(requested)) {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error || !fs::is_directory(path_)) {
    throw OutputError(fmt::format("{}: the output folder cannot be created: {}", path_.string(),
                                  error ? error.message() : "a file has this name"));
  }
  owner_ = fs::relative(fs::canonical(problem_file), fs::canonical(path_)).generic_string();
  refuse_if_taken(command);
}

void OutputFolder::refuse_if_taken(const std::string& command) const {
  const fs::path marker = path_ / "result.json";
  const auto [owner, stored_command] = stored_run(marker);
  if (owner == owner_) {
    const bool costly = stored_command == "design" || stored_command == "identify";
    if (!costly || stored_command == command || !fs::exists(path_ / "optimized.json")) return;
    throw OutputError(fmt::format(
        "{0}: holds the outcome of '{1}', which '{2}' would overwrite; name another folder with --out, such as --out "
        "{3}, or remove this one",
        path_.string(), stored_command, command,
        (path_.parent_path() / (path_.filename().string() + "_" + command)).string()));
  }
  if (!owner.empty()) {
    throw OutputError(fmt::format(
        "{}: holds the results of another problem ({}); they are never overwritten: name another folder with --out, or "
        "remove this one",
        path_.string(), (path_ / owner).lexically_normal().string()));
  }
  for (const char* name : kOutputs) {
    if (fs::exists(path_ / name)) {
      throw OutputError(fmt::format("{}: holds a {} that no run of this problem wrote; name another folder with --out",
                                    path_.string(), name));
    }
  }
}

void OutputFolder::write(const std::string& file, std::string_view content) const {
  write_file_atomically(path_ / file, content);
}

}  // namespace mbsopt
