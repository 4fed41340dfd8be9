// Makes unique names for a problem file. Refused characters become "_", and a number follows a taken name.
#pragma once

#include <string>
#include <vector>

namespace mbsopt::inline app {

class UniqueNames {
 public:
  enum class Kind { name, identifier };  // of models, bodies and joints; of sensors and points

  // renamed receives a sentence for each changed name.
  UniqueNames(Kind kind, std::vector<std::string> taken, std::vector<std::string>* renamed)
      : kind_(kind), taken_(std::move(taken)), renamed_(renamed) {}
  std::string add(const std::string& wanted);

 private:
  Kind kind_;
  std::vector<std::string> taken_;
  std::vector<std::string>* renamed_;  // nullptr: none is told
};

}  // namespace mbsopt::inline app
