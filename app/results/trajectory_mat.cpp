#include "app/results/trajectory_mat.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <set>

namespace mbsopt::inline app {
namespace {

// Types of data elements, and the class of a matrix of doubles.
constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kDouble = 9, kMatrix = 14, kDoubleClass = 6;

template <class Number>
void append(std::string& bytes, Number value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

// Appends the type, the number of bytes, the bytes, and zeros up to a multiple of eight.
void append_element(std::string& bytes, std::uint32_t type, const std::string& content) {
  append(bytes, type);
  append(bytes, static_cast<std::uint32_t>(content.size()));
  bytes += content;
  bytes.append((8 - content.size() % 8) % 8, '\0');
}

std::string vector_element(const std::string& name, const std::string& values, std::size_t rows) {
  std::string flags, dimensions, element;
  append(flags, kDoubleClass);
  append(flags, std::uint32_t{0});
  append(dimensions, static_cast<std::int32_t>(rows));
  append(dimensions, std::int32_t{1});
  append_element(element, kUint32, flags);
  append_element(element, kInt32, dimensions);
  append_element(element, kInt8, name);
  append_element(element, kDouble, values);
  return element;
}

}  // namespace

std::vector<std::string> mat_names(const std::vector<std::string>& columns) {
  constexpr std::size_t kLongest = 63;  // namelengthmax of MATLAB
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const std::string& column : columns) {
    std::string name = column;
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    const auto fits = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
    std::ranges::replace_if(
        name, [&](char c) { return !fits(c); }, '_');
    if (name.empty() || !letter(name[0])) name.insert(0, "x");
    name.resize(std::min(name.size(), kLongest));
    const std::string stem = name;
    for (int k = 2; !taken.insert(name).second; ++k) {
      const std::string number = "_" + std::to_string(k);
      name = stem.substr(0, kLongest - number.size()) + number;
    }
    names.push_back(name);
  }
  return names;
}

std::string to_mat(const Trajectory& trajectory) {
  constexpr std::size_t kText = 116, kSubsystem = 8;  // bytes of the header, filled with blanks and zeros
  std::string bytes = "MATLAB 5.0 MAT-file, written by mbsopt";
  bytes.resize(kText, ' ');
  bytes.resize(kText + kSubsystem, '\0');
  append(bytes, std::uint16_t{0x0100});                                           // version
  append(bytes, static_cast<std::uint16_t>(('M' << 8) | static_cast<int>('I')));  // shows the order of bytes
  const std::vector<std::string> names = mat_names(trajectory.columns);
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::string values;
    for (const std::vector<double>& row : trajectory.rows) append(values, row[k]);
    append_element(bytes, kMatrix, vector_element(names[k], values, trajectory.rows.size()));
  }
  return bytes;
}

}  // namespace mbsopt::inline app
