#pragma once

#include <string>
#include <utility>

#include "core/error.h"

namespace touchstone {

/// An Error that knows which field of a file it is about.
class FieldError : public Error {
 public:
  /// `field` with its path: "gel.thickness_mm", "lamps[2].power_W"; `message` says it, too.
  FieldError(SourceLocation where, std::string field, const std::string& message)
      : Error(std::move(where), message), field_(std::move(field)) {}

  const std::string& field() const { return field_; }

 private:
  std::string field_;
};

}  // namespace touchstone
