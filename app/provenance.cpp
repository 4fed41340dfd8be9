#include "app/provenance.hpp"

#include <IpoptConfig.h>
#include <ceres/version.h>
#include <fmt/format.h>
#include <nlopt.h>
#include <openssl/evp.h>
#include <sundials/sundials_config.h>
#include <CLI/Version.hpp>

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

namespace mbsopt {
namespace {

// Quoted where a shell would need it, so that the line can be pasted.
std::string shell_word(const std::string& word) {
  constexpr const char* plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string nlopt_version_text() {
  int major = 0, minor = 0, fix = 0;
  nlopt_version(&major, &minor, &fix);
  return fmt::format("{}.{}.{}", major, minor, fix);
}

nlohmann::ordered_json library_versions() {
  return {{"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"Ipopt", IPOPT_VERSION},
          {"NLopt", nlopt_version_text()},
          {"Ceres", CERES_VERSION_STRING},
          {"SUNDIALS", SUNDIALS_VERSION},
          {"fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)},
          {"nlohmann_json", fmt::format("{}.{}.{}", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                                        NLOHMANN_JSON_VERSION_PATCH)},
          {"CLI11", CLI11_VERSION},
          {"compiler", __VERSION__}};
}

}  // namespace

std::string program_version() { return MBSOPT_VERSION; }

std::string sha256_of_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return {};
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  std::array<char, 1 << 14> buffer;
  while (in.read(buffer.data(), buffer.size()), in.gcount() > 0) {
    EVP_DigestUpdate(context.get(), buffer.data(), static_cast<std::size_t>(in.gcount()));
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int size = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &size);
  return fmt::format("{:02x}", fmt::join(digest.begin(), digest.begin() + size, ""));
}

nlohmann::ordered_json provenance(const std::vector<std::string>& arguments, const std::string& input_as_stored,
                                  const std::string& problem_file, const std::vector<std::string>& data_files) {
  std::string command_line = "mbsopt";
  for (const std::string& argument : arguments) command_line += " " + shell_word(argument);
  nlohmann::ordered_json result{
      {"command_line", command_line}, {"input", input_as_stored}, {"input_sha256", sha256_of_file(problem_file)}};
  for (const std::string& file : data_files) {
    result["data_sha256"][std::filesystem::path(file).filename().string()] = sha256_of_file(file);
  }
  result["libraries"] = library_versions();
  return result;
}

}  // namespace mbsopt
