#include "app/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "app/atomic_file.hpp"

namespace mbsopt {
namespace {

constexpr int kJournalVersion = 1;

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw OutputError(fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno)));
}

std::string whole_lines_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t end = text.rfind('\n');
  text.resize(end == std::string::npos ? 0 : end + 1);
  return text;
}

}  // namespace

JournalContent read_journal(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kJournalFile;
  const auto refuse = [&](const std::string& why) { throw OutputError(file.string() + ": " + why); };
  if (!std::filesystem::exists(file))
    refuse("there is none; 'resume' goes on with a folder that 'design' or 'identify' of this version has begun");
  const std::string text = whole_lines_of(file);
  JournalContent content;
  int number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const Json line = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                  text.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
    begin = end + 1, ++number;
    if (!line.is_object()) refuse(fmt::format("line {} is not JSON", number));
    if (number == 1) {
      if (line.value("journal", 0) != kJournalVersion) refuse("is no journal of this version");
      content.header = line;
    } else if (line.contains("point")) {
      content.points.push_back(line["point"]);
    } else if (line.contains("hessians")) {
      content.hessians.push_back(line["hessians"]);
    } else if (line.contains("residuals")) {
      content.residuals.push_back(line["residuals"]);
    } else if (line.contains("start")) {
      content.starts.push_back(line["start"]);
    } else if (line.contains("iterate")) {
      content.last_iteration = line["iterate"].value("iteration", content.last_iteration);
    } else if (line.contains("ended")) {
      content.ended = line["ended"].get<std::string>();
    }
  }
  if (number == 0) refuse("is empty");
  return content;
}

Journal::Journal(const std::filesystem::path& folder, const Json& header) : path_(folder / kJournalFile) {
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail(path_, "cannot be created");
  Json first{{"journal", kJournalVersion}};
  first.update(header);
  const std::string line = first.dump() + "\n";
  if (::write(descriptor_, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    fail(path_, "cannot be written");
}

Journal::Journal(const std::filesystem::path& folder) : path_(folder / kJournalFile) {
  const std::size_t whole = whole_lines_of(path_).size();
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor_ < 0) fail(path_, "cannot be opened");
  if (::ftruncate(descriptor_, static_cast<off_t>(whole)) != 0) fail(path_, "cannot be cut to its last whole line");
}

Journal::~Journal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Journal::add(const char* kind, const Json& content) {
  const std::string line = Json{{kind, content}}.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::string_view rest = line;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(path_, "cannot be written");
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace mbsopt
