// The JSON Schema (draft 2020-12) of problem files, for editors and other tools: written from the same descriptions
// that the reader uses (core/scene/vocabulary.hpp). It knows shapes and names; the reader checks meanings, too.
// problems/problem.schema.json is this text.
#pragma once

#include <string>

namespace mbsopt {

std::string problem_schema_text();

}  // namespace mbsopt
