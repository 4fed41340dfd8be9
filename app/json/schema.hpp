// The JSON Schema (draft 2020-12) of problem files, for editors and other tools. It comes from the same descriptions as
// the reader (core/scene/vocabulary.hpp). It covers shapes and names; the reader checks meanings, too.
// problems/problem.schema.json is this text.
#pragma once

#include <string>

namespace mbsopt::inline app {

std::string problem_schema_text();

}  // namespace mbsopt::inline app
