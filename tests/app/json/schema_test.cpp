#include "app/json/schema.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/scene/type_table.hpp"
#include "source_folder.hpp"

TEST_CASE("problems/problem.schema.json is the schema of this version", "[json]") {
  std::ifstream file(MBSOPT_SOURCE_DIR "/problems/problem.schema.json");
  const std::string stored{std::istreambuf_iterator<char>(file), {}};
  CHECK(stored == mbsopt::problem_schema_text());
}

TEST_CASE("the schema knows names, defaults and what is required", "[json]") {
  const auto schema = nlohmann::json::parse(mbsopt::problem_schema_text());
  CHECK(schema.at("$schema") == "https://json-schema.org/draft/2020-12/schema");
  const auto& properties = schema.at("properties");
  CHECK(schema.at("additionalProperties") == false);
  CHECK(properties.at("gravity").at("default") == nlohmann::json::parse("[0.0, 0.0, -9.81]"));
  CHECK(properties.at("bodies").at("items").at("required") == nlohmann::json::parse(R"(["name", "mass", "inertia"])"));
  CHECK(properties.at("joints").at("items").at("oneOf").size() == std::size(mbsopt::kJointTypes));
  CHECK(properties.at("joints").at("items").at("oneOf").at(0).at("properties").at("type").at("const") == "revolute");
  CHECK(properties.at("joints").at("items").at("oneOf").at(1).at("properties").contains("axis1") == false);
  CHECK(properties.at("simulation").at("properties").at("integrator").at("properties").at("type").at("enum") ==
        nlohmann::json::parse(
            R"(["euler", "rk2", "bs3", "rk4", "dopri5", "tsit5", "verner6", "dopri853", "sdirk2", "sdirk3",
                                  "sdirk4", "gauss4", "lobatto3c", "rodas4", "radau5", "radau1a", "gauss6", "cvodes_adams",
                                  "cvodes_bdf"])"));
  CHECK(properties.at("drives").at("items").at("oneOf").size() == std::size(mbsopt::kDriveTypes));
}
