// Files that are hardly problem files.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/json/input_error.hpp"
#include "app/json/read_problem.hpp"
#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;

namespace {

std::string refusal_of(const std::string& text) {
  try {
    read_problem_text(text, "odd.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string error_of_file(const std::filesystem::path& file) {
  try {
    read_problem(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

const std::string kBody = R"("bodies": [{"name": "a", "mass": 1, "inertia": [1, 1, 1]}])";

}  // namespace

TEST_CASE("empty files are refused", "[json]") {
  CHECK(refusal_of("") == "odd.json:1:1: is empty, an object { ... } is expected");
  CHECK(refusal_of(" \n\n ") == "odd.json:1:1: is empty, an object { ... } is expected");
  CHECK_THAT(refusal_of("// only a comment"), Catch::Contains("odd.json:1:18: is not JSON"));
}

TEST_CASE("JSON that is not an object is refused", "[json]") {
  CHECK(refusal_of("[1, 2]") == "odd.json:1:1: must be an object {...}, found a list of 2");
  CHECK_THAT(refusal_of("3"), Catch::Contains("found the number 3"));
  CHECK_THAT(refusal_of("{} {}"), Catch::Contains("odd.json:1:4: is not JSON"));
  CHECK_THAT(refusal_of("{"), Catch::Contains("is not JSON"));
  CHECK_THAT(refusal_of("{\"a\": \"no end"), Catch::Contains("is not JSON"));
  CHECK_THAT(refusal_of("{\"a\": 1 /* no end"), Catch::Contains("is not JSON"));
  CHECK_THAT(refusal_of(std::string("{\0}", 3)), Catch::Contains("odd.json:1:2: is not JSON"));
}

TEST_CASE("text that is not UTF-8 is refused at its first bad byte", "[json]") {
  CHECK(refusal_of("{\n \"name\": \"\xFF\"}") == "odd.json:2:11: is not UTF-8 text: byte 0xFF");
  CHECK_THAT(refusal_of("\xFF\xFE{\0}"), Catch::Contains("odd.json:1:1: is not UTF-8"));            // UTF-16
  CHECK_THAT(refusal_of("{\"name\": \"\xC0\xAF\"}"), Catch::Contains("not UTF-8"));                 // overlong
  CHECK_THAT(refusal_of("{\"name\": \"\xED\xA0\x80\"}"), Catch::Contains("not UTF-8"));             // surrogate
  CHECK_THAT(refusal_of("{\"name\": \"\xE2\x82"), Catch::Contains("odd.json:1:11: is not UTF-8"));  // cut off
}

TEST_CASE("a byte order mark is allowed and is no column", "[json]") {
  CHECK(read_problem_text("\xEF\xBB\xBF{" + kBody + "}", "odd.json").scene.bodies.size() == 1);
  CHECK_THAT(refusal_of("\xEF\xBB\xBF{\"x\": 1, " + kBody + "}"), Catch::Contains("odd.json:1:2: x: unknown key"));
  CHECK_THAT(refusal_of("\xEF\xBB\xBF"), Catch::Contains("is empty"));
}

TEST_CASE("deep nesting is an error, not a crash", "[json]") {
  const std::string deep = "{\"bodies\": " + std::string(1000000, '[') + std::string(1000000, ']') + "}";
  CHECK_THAT(refusal_of(deep), Catch::Contains("nests deeper than 100 levels"));
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  CHECK_THAT(refusal_of(objects), Catch::Contains("nests deeper than 100 levels"));
  const std::string brackets(10000, '(');
  CHECK_THAT(refusal_of("{\"gravity\": [0, \"" + brackets + "\", 0], " + kBody + "}"), Catch::Contains("nests deeper"));
}

TEST_CASE("Windows line ends count as one", "[json]") {
  CHECK_THAT(refusal_of("{\r\n \"x\": 1,\r\n " + kBody + "}"), Catch::Contains("odd.json:2:2: x: unknown key"));
}

TEST_CASE("files that cannot be read are named", "[json]") {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  CHECK_THAT(error_of_file(folder), Catch::Contains("is a directory"));
  CHECK(error_of_file(folder / "no_such_problem.json") ==
        (folder / "no_such_problem.json").string() + ": there is no such file");
  const std::string long_name(100000, 'x');
  CHECK_THAT(error_of_file(long_name + ".json"), Catch::Contains("cannot be read"));
  CHECK(error_of_file(long_name + ".json").size() < 500);
  CHECK_FALSE(error_of_file("").empty());
  CHECK_THAT(error_of_file("/dev/zero"), Catch::Contains("is a pipe or a device"));
  CHECK_THAT(error_of_file("/proc/self/mem"), Catch::Contains("cannot be read: Input/output error"));
  const TemporaryFolder own;
  REQUIRE(::mkfifo(own.file("pipe.json").c_str(), 0600) == 0);
  CHECK_THAT(error_of_file(own.file("pipe.json")), Catch::Contains("is a pipe or a device"));  // nobody writes into it
}

TEST_CASE("a data file that is missing is reported where it is named", "[json]") {
  const std::string text = R"({"parameters": {"m": 1}, "bodies": [{"name": "a", "mass": "m", "inertia": [1, 1, 1]}],
 "sensors": {"x": {"quantity": "position", "body": "a", "component": "x"}},
 "identification": {"variables": ["m"], "experiments": [
   {"name": "r", "data": "no_such.csv", "channels": [{"column": "x", "sensor": "x"}]}]}})";
  CHECK(refusal_of(text) ==
        "odd.json:4:26: identification.experiments[0].data: there is no file 'no_such.csv'; a CSV file is expected");
}

TEST_CASE("keys of any characters are pointed at, in one line each", "[json]") {
  const std::string text = R"({
 "parameters": {
  "a\"]x[\\": {"value": 1, "lower": 2, "allow_unused": true},
  "b\nc": 1, "": 2, "\"].": 3},
 )" + kBody + "}";
  const std::string all = refusal_of(text);
  CHECK_THAT(all, Catch::Contains(R"(odd.json:3:25: parameters["a\"]x[\\"].value: is 1, below)"));
  CHECK_THAT(all, Catch::Contains("odd.json:4:11: parameters[\"b c\"]: the name 'b c' must be"));
  CHECK_THAT(all, Catch::Contains("odd.json:4:18: parameters[\"\"]: the name '' must be"));
  CHECK_THAT(all, Catch::Contains(R"(odd.json:4:29: parameters["\"]."]: the name)"));
  CHECK(std::count(all.begin(), all.end(), '\n') == 4);
}

TEST_CASE("of a force whose type is unknown or missing nothing else is said", "[json]") {
  for (const std::string type : {R"("type": "spring", )", ""}) {
    const std::string error =
        refusal_of(R"({"format": 1, "name": "p", )" + kBody + R"(, "forces": [{"name": "f", )" + type +
                   R"("body1": "ground", "stiffness": 3}], "simulation": {"end_time": 1}})");
    INFO(error);
    CHECK(error.find("forces[0].type: ") != std::string::npos);
    CHECK(error.find("body2") == std::string::npos);
  }
}

TEST_CASE("a key that is there twice is one error, and its value is the first", "[json]") {
  const std::string error =
      refusal_of(R"({"format": 1, "name": "p", )" + kBody +
                 R"(, "parameters": {"k": 1, "k": 2, "m": 3}, "simulation": {"end_time": "k2"}})");
  INFO(error);
  CHECK(error.find("parameters.k: this key is there twice") != std::string::npos);
  CHECK(error.find("k, k") == std::string::npos);
}
