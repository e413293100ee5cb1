// YAML texts by core alone: every kind of field that a struct may have, and numbers that are changed in the text. The
// project's own structs are scene_files_target's.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/edited_yaml.h"
#include "core/yaml_reader.h"
#include "tests/fuzz/fuzz_target.h"

namespace touchstone::fuzz {
namespace {

enum class Colour { red, green };

EnumNames<Colour> enum_names(Colour) {
  return {{"red", Colour::red}, {"green", Colour::green}};
}

/// Stands as a number, a list or a name.
struct Loose {
  double number = 0.0;
};

void read_value(YamlReader& in, Loose& loose, Allowed allowed) {
  if (in.is_list()) {
    for (const double part : in.numbers(allowed)) loose.number += part;
  } else if (!in.is_map()) {
    if (in.text() != "none") loose.number = in.number(allowed);
  } else {
    fail_at(in.where(), "{}a number, a list or none is needed", in.context());
  }
}

struct Part {
  std::string name;
  double size_mm = 1.0;
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  std::vector<std::vector<double>> rows;
};

void fields(YamlReader& in, Part& part) {
  in.required("name", part.name);
  in.optional("size_mm", part.size_mm, Allowed::above(0.0));
  in.optional("place_mm", part.place_mm, Allowed::within(-1e3, 1e3));
  in.optional("rows", part.rows);
}

struct Everything {
  int count = 0;
  std::int64_t large = 0;
  std::uint64_t seed = 0;
  bool flag = false;
  Colour colour = Colour::red;
  Eigen::Vector2i grid = Eigen::Vector2i::Zero();
  std::optional<double> perhaps;
  Loose loose;
  Part part;
  std::vector<Part> parts;
  std::vector<std::string> names;
};

void fields(YamlReader& in, Everything& all) {
  in.optional("count", all.count, Allowed::within(-5, 1e6));
  in.optional("large", all.large);
  in.optional("seed", all.seed);
  in.optional("flag", all.flag);
  in.optional("colour", all.colour);
  in.optional("grid", all.grid, Allowed::at_least(0.0));
  in.optional("perhaps", all.perhaps, Allowed::above_up_to(0.0, 10.0));
  in.optional("loose", all.loose);
  if (in.has("loose") && in.where("loose").line < 0) fail("no place");
  in.optional("part", all.part);
  in.required("parts", all.parts);
  in.optional("names", all.names);
}

/// A number that was put into the text must be what is found there.
bool changes_numbers(const std::string& text, const std::string& path) {
  return gives_result([&] {
    const auto groups = find_yaml_numbers(text, "a.yaml", path, {"job.yaml", 1});
    std::vector<std::pair<YamlNumber, double>> changed;
    for (const auto& group : groups) {
      for (const YamlNumber& number : group) changed.emplace_back(number, 0.125 * static_cast<double>(changed.size()));
    }
    const auto again = find_yaml_numbers(with_yaml_numbers(text, changed), "b.yaml", path, {"job.yaml", 1});
    TS_ASSERT(again.size() == groups.size());
    std::size_t at = 0;
    for (const auto& group : again) {
      for (const YamlNumber& number : group) TS_ASSERT(number.value == changed.at(at++).second);
    }
  });
}

}  // namespace

bool reads(std::string_view bytes) {
  const std::string text(bytes);
  bool read = gives_result([&] { parse_yaml<Everything>(text, "a.yaml"); });
  for (const char* path : {"loose", "parts[*].size_mm", "part.place_mm[1]", "part.rows[0]"}) {
    read |= changes_numbers(text, path);
  }
  return read;
}

}  // namespace touchstone::fuzz
