#pragma once
// The surface's displacement, for a press that leaves it out step by step and is looked at now and then.

#include <memory>

#include "fem/contact/press.h"
#include "fem/elements/compliance.h"

namespace touchstone::fem {

/// Made once for a gel, which must outlive it. Safe to use from many threads.
class PressFields {
 public:
  /// Makes what all states share.
  explicit PressFields(const Compliance& gel);
  ~PressFields();
  PressFields(PressFields&&) noexcept;
  PressFields& operator=(PressFields&&) noexcept;

  /// A state made with PressOutput::forces with what PressOutput::fields would have added, to the bit.
  /// @pre the press was one of this gel, without relaxation: what a relaxing gel remembers isn't in its state
  PressState with_fields(PressState state) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace touchstone::fem
