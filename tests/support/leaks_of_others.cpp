// What LeakSanitizer is to pass over, and what it needs to look in peace.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <new>

// Memory that OpenImageIO's own libraries (dcmtk's log, libsrt) keep to the end of the process: what LeakSanitizer is
// to pass over.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:liboflog\nleak:libsrt-gnutls\n";
}

namespace touchstone::lab {
namespace {

/// LeakSanitizer looks for leaks when the program ends, and crashes ("Tracer caught signal 11") if a worker thread of
/// oneTBB ends at that very moment. So they are ended first.
class WorkersEndFirst : public testing::Environment {
 public:
  void SetUp() override { workers_ = tbb::task_scheduler_handle{tbb::attach{}}; }
  void TearDown() override { tbb::finalize(workers_, std::nothrow); }

 private:
  tbb::task_scheduler_handle workers_;
};

const testing::Environment* const kWorkersEndFirst = testing::AddGlobalTestEnvironment(new WorkersEndFirst);

}  // namespace
}  // namespace touchstone::lab
