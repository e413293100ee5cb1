// Memory that OpenImageIO's own libraries (dcmtk's log, libsrt) keep to the end of the process: what LeakSanitizer is
// to pass over.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:liboflog\nleak:libsrt-gnutls\n";
}
