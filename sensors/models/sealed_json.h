#pragma once
// Model files of JSON with a checksum, and matrices in them. For the .cpp files of models only, as json_field.h.

#include <string>

#include "core/sha256.h"
#include "sensors/models/json_field.h"

namespace touchstone::sensors {

/// The text of a model file: the map, with its own SHA-256 as the member "sha256". The sum is taken over the map
/// without that member, written without spaces, its names in order.
inline std::string seal(Json json) {
  json.erase("sha256");
  const std::string sum = sha256_of(json.dump());
  json["sha256"] = sum;
  return json.dump(1) + "\n";
}

/// Reads what seal() wrote, without the member "sha256". @throws Error naming file and, where it's known, line: not
/// JSON, another format or version, or a checksum that is missing or doesn't fit
inline Json unseal(const std::string& text, const std::string& name, const char* format, int version) {
  Json json = parse_json(text, name);
  const JsonField root{json, "", name};
  root.expect_format(format, version);
  const std::string sum = root.at("sha256").text();
  json.erase("sha256");
  if (sha256_of(json.dump()) != sum) fail_at({name, 0}, "is damaged or was changed: its checksum doesn't fit");
  return json;
}

/// A list of numbers.
inline Json json_of(const Eigen::VectorXd& vector) {
  Json list = Json::array();
  for (const double value : vector) list.push_back(value);
  return list;
}

/// A list of rows.
inline Json json_of(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(json_of(Eigen::VectorXd(matrix.row(i))));
  return rows;
}

/// A list of numbers of any length but 0.
inline Eigen::VectorXd vector_of(const JsonField& field) {
  if (!field.value.is_array()) field.refuse("is a {}, a list is needed", field.value.type_name());
  if (field.value.empty()) field.refuse("is empty");
  Eigen::VectorXd vector(static_cast<Eigen::Index>(field.value.size()));
  for (std::size_t i = 0; i < field.value.size(); ++i) vector[static_cast<Eigen::Index>(i)] = field.at(i).number();
  return vector;
}

/// A list of rows, all as long as the first; neither may be empty.
inline Eigen::MatrixXd matrix_of(const JsonField& field) {
  if (!field.value.is_array()) field.refuse("is a {}, a list of rows is needed", field.value.type_name());
  if (field.value.empty()) field.refuse("is empty");
  const Eigen::VectorXd first = vector_of(field.at(std::size_t{0}));
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(field.value.size()), first.size());
  for (std::size_t i = 0; i < field.value.size(); ++i) {
    field.at(i).expect_list(static_cast<std::size_t>(first.size()));
    matrix.row(static_cast<Eigen::Index>(i)) = vector_of(field.at(i)).transpose();
  }
  return matrix;
}

}  // namespace touchstone::sensors
