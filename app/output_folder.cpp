#include "app/output_folder.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/atomic_file.hpp"

namespace mbsopt {
namespace fs = std::filesystem;
namespace {

constexpr std::array kOutputs{"result.json",    "trajectory.csv", "report.html",
                              "optimized.json", "history.csv",    "residuals.csv"};

// A folder's name from a problem's: no separators, no leading dot, no control characters.
std::string folder_name(std::string name) {
  for (char& c : name) {
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20) c = '_';
  }
  if (name.empty() || name.front() == '.') name.insert(name.begin(), '_');
  return name;
}

// The problem a result.json belongs to; empty where it is not one of ours.
std::string stored_owner(const fs::path& file) {
  std::ifstream in(file);
  const nlohmann::json result = nlohmann::json::parse(in, nullptr, false);
  if (!result.is_object() || result.value("program", nlohmann::json()) != "mbsopt") return {};
  const auto provenance = result.find("provenance");
  if (provenance == result.end() || !provenance->is_object()) return {};
  const auto input = provenance->find("input");
  return input != provenance->end() && input->is_string() ? input->get<std::string>() : std::string{};
}

}  // namespace

OutputFolder::OutputFolder(const std::string& requested, const std::string& problem_name,
                           const std::string& problem_file)
    : path_(requested.empty() ? fs::path("out") / folder_name(problem_name) : fs::path(requested)) {
  std::error_code error;
  fs::create_directories(path_, error);
  if (error || !fs::is_directory(path_)) {
    throw OutputError(fmt::format("{}: the output folder cannot be created: {}", path_.string(),
                                  error ? error.message() : "a file has this name"));
  }
  owner_ = fs::relative(fs::canonical(problem_file), fs::canonical(path_)).generic_string();
  refuse_if_foreign();
}

void OutputFolder::refuse_if_foreign() const {
  const fs::path marker = path_ / "result.json";
  const std::string owner = stored_owner(marker);
  if (owner == owner_) return;
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

void OutputFolder::remove(const std::string& file) const {
  std::error_code ignored;
  fs::remove(path_ / file, ignored);
}

}  // namespace mbsopt
