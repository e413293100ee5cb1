#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "python/src/convert.h"

namespace touchstone::python {

/// An estimator that is for one thread: calls wait for each other, without the GIL.
template <typename Estimator>
class Guarded {
 public:
  template <typename... Args>
  explicit Guarded(Args&&... args) : estimator_(std::forward<Args>(args)...) {}

  /// `work` gets the estimator; what it returns must not point into it.
  template <typename Work>
  auto with(const Work& work) {
    const py::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    return work(estimator_);
  }

 private:
  std::mutex mutex_;
  Estimator estimator_;
};

}  // namespace touchstone::python
