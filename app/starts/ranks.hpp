// The processes of a run that spans several, maybe on several machines: rank 0 runs the command, reads and writes all
// files and prints; the others compute what it tells them (start_workers.hpp).
//
// Messages, all of JSON:
//   to a rank   {"work": {...}} {"start": 7} {"stop": true} {"dismissed": true}
//   to rank 0   {"reply": 7, "ok": true, "text": "..."} {"interrupted": true} {"failed": "why"}
#pragma once

#include <optional>
#include <string>

namespace mbsopt {

// Between looks at what has come from other ranks. MPI itself would wait at full speed.
inline constexpr int kPollMilliseconds = 5;

struct Ranks {
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;

  struct Message {
    int from = 0;
    std::string text;
  };
  // Long texts to a rank that sends a long one itself would have both wait for ever: only one side may send them.
  virtual void send(int to, const std::string& text) = 0;
  virtual std::optional<Message> receive() = 0;  // does not wait: none where nothing has come
};

}  // namespace mbsopt
