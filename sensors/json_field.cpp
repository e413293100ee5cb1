#include "sensors/json_field.h"

namespace touchstone::sensors {

nlohmann::json parse_model_json(const std::string& text, const std::string& name) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const auto byte = std::min(error.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(byte), '\n');
    throw Error({name, static_cast<int>(line)}, "isn't valid JSON");
  } catch (const nlohmann::json::exception& error) {  // a number beyond the range of double
    throw Error({name, 0}, fmt::format("isn't usable JSON: {}", error.what()));
  }
}

}  // namespace touchstone::sensors
