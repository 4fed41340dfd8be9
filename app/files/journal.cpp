#include "app/files/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <random>
#include <utility>

#include "app/files/atomic_file.hpp"
#include "app/files/sha256.hpp"
#include "optim/machine/write_all.hpp"
#include "optim/problem/regular_file.hpp"

namespace mbsopt::inline app {
namespace {

constexpr int kJournalVersion = 6;
constexpr std::string_view kSealBegin = ",\"sha256\":\"", kSealEnd = "\"}";
constexpr std::size_t kSealSize = 64;  // of SHA-256 in hex

// The line of a record, with its checksum. Moves the journal's end behind it.
std::string sealed(const Json& record, JournalEnd& end) {
  std::string text = json_text(record);
  text.pop_back();  // the closing bracket
  end.seal = sha256_of(end.seal + text);
  text += fmt::format("{}{}{}\n", kSealBegin, end.seal, kSealEnd);
  end.bytes += text.size();
  return text;
}

// The checksum at the end of a line; empty if it does not fit the line.
std::string seal_of(std::string_view line, const std::string& seal_before) {
  const std::size_t tail = kSealBegin.size() + kSealSize + kSealEnd.size();
  if (line.size() <= tail) return {};
  const std::string_view body = line.substr(0, line.size() - tail), end = line.substr(body.size());
  const std::string_view seal = end.substr(kSealBegin.size(), kSealSize);
  if (!end.starts_with(kSealBegin) || !end.ends_with(kSealEnd)) return {};
  return sha256_of(seal_before + std::string(body)) == seal ? std::string(seal) : std::string();
}

Json object_of(std::string_view line) {
  const Json json = read_json_or_discarded(line);
  return json.is_object() ? json : Json::object();
}

std::string drawn_run_id() {
  std::random_device system;
  return fmt::format("{:08x}{:08x}", system(), system());
}

// Refuses a file of this name that no run of this program has written, and does not follow a link.
void refuse_foreign(const std::filesystem::path& file) {
  const std::filesystem::file_type type = std::filesystem::symlink_status(file).type();
  if (type == std::filesystem::file_type::not_found) return;
  bool ours = false;
  if (type == std::filesystem::file_type::regular) {
    const std::string text = content_of_regular_file(file);
    const Json first = object_of(std::string_view(text).substr(0, text.find('\n')));
    ours = first.value("program", Json()) == "mbsopt" && first.contains("journal");
  }
  if (!ours)
    throw OutputError(
        file.string() +
        ": is not a journal of mbsopt and is never overwritten; name another folder with --out, or move it");
}

// Begins a journal with its first line.
JournalEnd begun(const std::filesystem::path& file, const Json& header) {
  refuse_foreign(file);
  JournalEnd end;
  Json first{{"journal", kJournalVersion}, {"run", drawn_run_id()}};
  first.update(header);
  write_file_atomically(file, sealed(first, end));
  return end;
}

std::string text_of(const std::filesystem::path& file) {
  try {
    return content_of_regular_file(file);
  } catch (const FileError& error) {
    throw OutputError(file.string() + ": " + error.what());
  }
}

}  // namespace

JournalContent read_journal(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kJournalFile;
  const auto refuse = [&](const std::string& why) { throw OutputError(file.string() + ": " + why); };
  if (!std::filesystem::exists(file))
    refuse("there is none; 'resume' continues a folder that 'design', 'identify' or 'sweep' of this version has begun");
  const std::string text = text_of(file);
  JournalContent content;
  JournalEnd& last = content.end;
  int number = 0;
  for (std::size_t end; (end = text.find('\n', last.bytes)) != std::string::npos; last.bytes = end + 1) {
    const std::string_view line = std::string_view(text).substr(last.bytes, end - last.bytes);
    const Json record = object_of(line);
    if (++number == 1 && record.value("journal", Json()) != kJournalVersion) refuse("is no journal of this version");
    last.seal = seal_of(line, last.seal);
    if (last.seal.empty() || record.empty())
      refuse(fmt::format(
          "line {} is damaged, or not of this run: its checksum does not fit; {}", number,
          number == 1 ? "start the run anew" : "remove this line and all after it, and 'resume' continues from there"));
    if (number == 1)
      content.header = record;
    else
      content.records[record.begin().key()].push_back(record.begin().value());
  }
  if (number == 0) refuse("holds no whole line; start the run anew");
  return content;
}

const std::vector<Json>& JournalContent::of(const std::string& kind) const {
  static const std::vector<Json> none;
  const auto found = records.find(kind);
  return found == records.end() ? none : found->second;
}

Journal::Journal(const std::filesystem::path& folder, const Json& header)
    : Journal(folder, begun(folder / kJournalFile, header)) {}

Journal::Journal(const std::filesystem::path& folder, JournalEnd end)
    : path_(folder / kJournalFile), end_(std::move(end)) {
  refuse_foreign(path_);
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor_ < 0) throw WriteError(path_, "cannot be opened");
  if (::ftruncate(descriptor_, static_cast<off_t>(end_.bytes)) == 0) return;
  ::close(descriptor_);
  throw WriteError(path_, "cannot be cut to its last whole line");
}

Journal::~Journal() { ::close(descriptor_); }

void Journal::add(const std::string& kind, const Json& content) {
  JournalEnd end = end_;
  const std::string line = sealed(Json{{kind, content}}, end);
  if (!write_all(descriptor_, line) || ::fdatasync(descriptor_) != 0) {
    const int why = errno;
    [[maybe_unused]] const int cut =
        ::ftruncate(descriptor_, static_cast<off_t>(end_.bytes));  // else a reader drops it
    errno = why;
    throw WriteError(path_, "cannot be written");
  }
  end_ = std::move(end);
}

bool Journal::exists() const {
  struct stat file;
  return ::fstat(descriptor_, &file) == 0 && file.st_nlink > 0;
}

}  // namespace mbsopt::inline app
