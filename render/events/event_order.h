#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace touchstone::render {

/// Sorts events of the time (begin_us, end_us] by their times; events of one time keep their order. A radix sort: the
/// time it takes grows with the events alone. `spare` is memory to work in, its content lost. @pre begin_us < end_us
void sort_by_time(std::vector<Event>& events, std::vector<Event>& spare, std::int64_t begin_us, std::int64_t end_us);

}  // namespace touchstone::render
