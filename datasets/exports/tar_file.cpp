#include "datasets/exports/tar_file.h"

#include <archive.h>
#include <archive_entry.h>

#include "core/error.h"

namespace touchstone::datasets {

struct TarWriter::Archive {
  archive* writer = archive_write_new();
  archive_entry* entry = archive_entry_new();

  Archive() = default;
  Archive(const Archive&) = delete;
  Archive& operator=(const Archive&) = delete;
  ~Archive() {
    archive_entry_free(entry);
    archive_write_free(writer);
  }
};

TarWriter::TarWriter(const std::filesystem::path& file) : name_(file.string()), archive_(std::make_unique<Archive>()) {
  check(archive_write_set_format_ustar(archive_->writer));
  check(archive_write_add_filter_none(archive_->writer));
  check(archive_write_open_filename(archive_->writer, name_.c_str()));
}

TarWriter::~TarWriter() = default;

void TarWriter::check(int result) const {
  if (result >= ARCHIVE_WARN) return;
  const char* why = archive_error_string(archive_->writer);
  fail("{}: can't be written ({})", name_, why != nullptr ? why : "libarchive doesn't say why");
}

void TarWriter::add(const std::string& name, std::string_view content) {
  constexpr std::size_t kLongestName = 100;
  constexpr int kReadableByAll = 0644;
  TS_ASSERT(name.size() <= kLongestName);
  archive_entry* entry = archive_entry_clear(archive_->entry);
  archive_entry_set_pathname(entry, name.c_str());
  archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_entry_set_perm(entry, kReadableByAll);
  archive_entry_set_mtime(entry, 0, 0);
  archive_entry_set_uid(entry, 0);
  archive_entry_set_gid(entry, 0);
  check(archive_write_header(archive_->writer, entry));
  const la_ssize_t written = archive_write_data(archive_->writer, content.data(), content.size());
  if (written != static_cast<la_ssize_t>(content.size())) check(ARCHIVE_FATAL);
}

void TarWriter::close() {
  check(archive_write_close(archive_->writer));
}

}  // namespace touchstone::datasets
