#include "core/hdf5_file.h"

#include <hdf5.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "core/error.h"
#include "core/isolated_call.h"

namespace touchstone {
namespace {

constexpr std::int64_t kChunkBytes = 256 * 1024;  // well under HDF5's cache of 1 MB a dataset: each is packed once
constexpr std::size_t kMemoryStep = 4 << 20;
constexpr std::size_t kMostTextBytes = 1 << 24;  // of an attribute
constexpr unsigned kDeflateLevel = 4;            // of 9; higher ones cost time and win a percent
constexpr int kPackedLevel = 1;                  // of pictures with noise, which hardly pack
constexpr int kTrialSeconds = 60;

static_assert(std::is_same_v<hid_t, Hdf5Id> || sizeof(hid_t) == sizeof(Hdf5Id));

std::vector<hsize_t> extents(const std::vector<std::int64_t>& shape) {
  return {shape.begin(), shape.end()};
}

/// Closes one HDF5 object.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

std::atomic<Hdf5Guard> the_guard{nullptr};

/// To be held for as long as HDF5 is at work.
std::shared_ptr<void> hold() {
  const Hdf5Guard guard = the_guard;
  return guard != nullptr ? guard() : nullptr;
}

/// HDF5 prints its own stack of errors unless asked not to; ours are exceptions.
void keep_hdf5_quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Handle text_type(std::size_t length) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, std::max<std::size_t>(1, length));
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return {type, H5Tclose};
}

}  // namespace

void set_hdf5_guard(Hdf5Guard guard) {
  the_guard = guard;
}

template <>
Hdf5Id hdf5_type<std::uint8_t>() {
  const auto held = hold();
  return H5T_NATIVE_UINT8;
}
template <>
Hdf5Id hdf5_type<std::uint16_t>() {
  const auto held = hold();
  return H5T_NATIVE_UINT16;
}
template <>
Hdf5Id hdf5_type<std::uint32_t>() {
  const auto held = hold();
  return H5T_NATIVE_UINT32;
}
template <>
Hdf5Id hdf5_type<std::uint64_t>() {
  const auto held = hold();
  return H5T_NATIVE_UINT64;
}
template <>
Hdf5Id hdf5_type<std::int32_t>() {
  const auto held = hold();
  return H5T_NATIVE_INT32;
}
template <>
Hdf5Id hdf5_type<std::int64_t>() {
  const auto held = hold();
  return H5T_NATIVE_INT64;
}
template <>
Hdf5Id hdf5_type<float>() {
  const auto held = hold();
  return H5T_NATIVE_FLOAT;
}
template <>
Hdf5Id hdf5_type<double>() {
  const auto held = hold();
  return H5T_NATIVE_DOUBLE;
}

Hdf5Id Hdf5Writer::check(Hdf5Id id, const char* what) const {
  if (id < 0) fail("{}: can't be written ({})", name_, what);
  return id;
}

void Hdf5Writer::check_done(int result, const char* what) const {
  if (result < 0) fail("{}: can't be written ({})", name_, what);
}

std::vector<std::uint8_t> pack_hdf5_row(const void* values, std::size_t bytes, std::size_t item_bytes) {
  TS_ASSERT(item_bytes > 0 && bytes % item_bytes == 0);
  const auto* from = static_cast<const std::uint8_t*>(values);
  std::vector<std::uint8_t> shuffled(from, from + bytes);
  const std::size_t items = bytes / item_bytes;
  if (item_bytes > 1) {  // first bytes of all numbers, then second ones, ...
    for (std::size_t b = 0; b < item_bytes; ++b) {
      for (std::size_t i = 0; i < items; ++i) shuffled[b * items + i] = from[i * item_bytes + b];
    }
  }
  uLongf size = compressBound(static_cast<uLong>(bytes));
  std::vector<std::uint8_t> packed(size);
  const int result = compress2(packed.data(), &size, shuffled.data(), static_cast<uLong>(bytes), kPackedLevel);
  TS_ASSERT(result == Z_OK);
  packed.resize(size);
  return packed;
}

Hdf5Writer::Hdf5Writer(const std::filesystem::path& file) : Hdf5Writer(file, 0) {}

Hdf5Writer::Hdf5Writer(const std::filesystem::path& file, std::size_t user_block) : name_(file.string()) {
  const auto held = hold();
  keep_hdf5_quiet();
  const Handle access(check(H5Pcreate(H5P_FILE_ACCESS), "file access"), H5Pclose);
  // Later versions mark a file as open for writing until it's closed.
  check_done(H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_V18), "format version");
  // In memory until it's whole: HDF5 can't close a file of which it can't write the last bytes (a full disk), and then
  // crashes at the end of the process.
  check_done(H5Pset_fapl_core(access, kMemoryStep, 0), "memory");
  const Handle creation(check(H5Pcreate(H5P_FILE_CREATE), "file creation"), H5Pclose);
  check_done(H5Pset_obj_track_times(creation, 0), "times");
  check_done(H5Pset_userblock(creation, user_block), "user block");
  file_ = check(H5Fcreate(name_.c_str(), H5F_ACC_TRUNC, creation, access), "creating the file");
}

Hdf5Writer::~Hdf5Writer() {
  const auto held = hold();
  for (auto& [path, dataset] : datasets_) H5Dclose(dataset.id);
  if (file_ >= 0) H5Fclose(file_);
}

void Hdf5Writer::add_dataset(const Hdf5Description& description, Hdf5Id type, std::size_t item_bytes, std::int64_t rows,
                             const std::vector<std::int64_t>& row_shape) {
  auto row_bytes = static_cast<std::int64_t>(item_bytes);
  for (const std::int64_t extent : row_shape) row_bytes *= extent;
  const std::int64_t fitting = row_bytes > 0 ? kChunkBytes / row_bytes : 1;
  add_chunked_dataset(description, type, rows, row_shape,
                      std::clamp<std::int64_t>(fitting, 1, std::max<std::int64_t>(1, rows)));
}

void Hdf5Writer::add_chunked_dataset(const Hdf5Description& description, Hdf5Id type, std::int64_t rows,
                                     const std::vector<std::int64_t>& row_shape, std::int64_t rows_per_chunk) {
  const auto held = hold();
  TS_ASSERT(!datasets_.contains(description.path) && rows >= 0);
  Dataset dataset;
  dataset.shape.push_back(rows);
  dataset.shape.insert(dataset.shape.end(), row_shape.begin(), row_shape.end());
  const std::vector<hsize_t> shape = extents(dataset.shape);
  const bool empty = std::find(shape.begin(), shape.end(), hsize_t{0}) != shape.end();
  const Handle creation(check(H5Pcreate(H5P_DATASET_CREATE), "dataset creation"), H5Pclose);
  check_done(H5Pset_obj_track_times(creation, 0), "times");
  if (!empty) {
    std::vector<hsize_t> chunk = shape;
    chunk[0] = static_cast<hsize_t>(rows_per_chunk);
    check_done(H5Pset_chunk(creation, static_cast<int>(chunk.size()), chunk.data()), "chunks");
    check_done(H5Pset_shuffle(creation), "shuffle");
    check_done(H5Pset_deflate(creation, kDeflateLevel), "compression");
  }
  const Handle space(check(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), "shape"), H5Sclose);
  make_group_of(description.path);
  dataset.id = check(H5Dcreate2(file_, description.path.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT),
                     description.path.c_str());
  const Hdf5Id id = dataset.id;
  datasets_.emplace(description.path, std::move(dataset));
  describe(id, description);
}

void Hdf5Writer::add_growing_dataset(const Hdf5Description& description, Hdf5Id type, std::size_t item_bytes) {
  const auto held = hold();
  TS_ASSERT(!datasets_.contains(description.path));
  const Handle creation(check(H5Pcreate(H5P_DATASET_CREATE), "dataset creation"), H5Pclose);
  check_done(H5Pset_obj_track_times(creation, 0), "times");
  const hsize_t chunk = static_cast<hsize_t>(kChunkBytes) / item_bytes;
  check_done(H5Pset_chunk(creation, 1, &chunk), "chunks");
  check_done(H5Pset_shuffle(creation), "shuffle");
  check_done(H5Pset_deflate(creation, kDeflateLevel), "compression");
  const hsize_t none = 0;
  const hsize_t endless = H5S_UNLIMITED;
  const Handle space(check(H5Screate_simple(1, &none, &endless), "shape"), H5Sclose);
  make_group_of(description.path);
  Dataset dataset;
  dataset.shape = {0};
  dataset.id = check(H5Dcreate2(file_, description.path.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT),
                     description.path.c_str());
  const Hdf5Id id = dataset.id;
  datasets_.emplace(description.path, std::move(dataset));
  describe(id, description);
}

void Hdf5Writer::append_numbers(const std::string& path, Hdf5Id type, const void* values, std::int64_t count) {
  const auto held = hold();
  const auto found = datasets_.find(path);
  TS_ASSERT(found != datasets_.end() && found->second.shape.size() == 1);
  if (count == 0) return;
  const std::int64_t first = found->second.shape[0];
  found->second.shape[0] += count;
  const auto size = static_cast<hsize_t>(found->second.shape[0]);
  check_done(H5Dset_extent(found->second.id, &size), path.c_str());
  write_rows(path, type, first, count, values, static_cast<std::size_t>(count));
}

void Hdf5Writer::make_group_of(const std::string& path) {
  for (std::size_t end = path.find('/', 1); end != std::string::npos; end = path.find('/', end + 1)) {
    const std::string group = path.substr(0, end);
    if (H5Lexists(file_, group.c_str(), H5P_DEFAULT) > 0) continue;
    const Handle creation(check(H5Pcreate(H5P_GROUP_CREATE), "group creation"), H5Pclose);
    check_done(H5Pset_obj_track_times(creation, 0), "times");
    const Handle made(check(H5Gcreate2(file_, group.c_str(), H5P_DEFAULT, creation, H5P_DEFAULT), group.c_str()),
                      H5Gclose);
  }
}

void Hdf5Writer::write_rows(const std::string& path, Hdf5Id type, std::int64_t first, std::int64_t count,
                            const void* values, std::size_t size) {
  const auto held = hold();
  const auto found = datasets_.find(path);
  TS_ASSERT(found != datasets_.end());
  const Dataset& dataset = found->second;
  std::vector<hsize_t> start(dataset.shape.size(), 0);
  std::vector<hsize_t> extent = extents(dataset.shape);
  start[0] = static_cast<hsize_t>(first);
  extent[0] = static_cast<hsize_t>(count);
  std::size_t wanted = 1;
  for (const hsize_t part : extent) wanted *= part;
  TS_ASSERT(size == wanted && first + count <= dataset.shape[0]);
  if (size == 0) return;
  const Handle memory(check(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), "shape"),
                      H5Sclose);
  const Handle place(check(H5Dget_space(dataset.id), "shape"), H5Sclose);
  check_done(H5Sselect_hyperslab(place, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr), "rows");
  check_done(H5Dwrite(dataset.id, type, memory, place, H5P_DEFAULT, values), path.c_str());
}

void Hdf5Writer::write_packed_row(const std::string& path, std::int64_t row, std::span<const std::uint8_t> packed) {
  const auto held = hold();
  const auto found = datasets_.find(path);
  TS_ASSERT(found != datasets_.end() && row >= 0 && row < found->second.shape[0]);
  std::vector<hsize_t> offset(found->second.shape.size(), 0);
  offset[0] = static_cast<hsize_t>(row);
  check_done(H5Dwrite_chunk(found->second.id, H5P_DEFAULT, 0, offset.data(), packed.size(), packed.data()),
             path.c_str());
}

void Hdf5Writer::write_number(const Hdf5Description& description, std::int64_t value) {
  const auto held = hold();
  const Handle space(check(H5Screate(H5S_SCALAR), "shape"), H5Sclose);
  const Handle creation(check(H5Pcreate(H5P_DATASET_CREATE), "dataset creation"), H5Pclose);
  check_done(H5Pset_obj_track_times(creation, 0), "times");
  make_group_of(description.path);
  const Handle dataset(
      check(H5Dcreate2(file_, description.path.c_str(), H5T_STD_I64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT),
            description.path.c_str()),
      H5Dclose);
  check_done(H5Dwrite(dataset, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value), description.path.c_str());
  describe(dataset, description);
}

void Hdf5Writer::write_texts(const Hdf5Description& description, const std::vector<std::string>& texts) {
  const auto held = hold();
  std::size_t longest = 1;
  for (const std::string& text : texts) longest = std::max(longest, text.size());
  std::vector<char> padded(longest * texts.size(), '\0');
  for (std::size_t i = 0; i < texts.size(); ++i) {
    std::copy(texts[i].begin(), texts[i].end(), padded.begin() + static_cast<std::ptrdiff_t>(i * longest));
  }
  const Handle type = text_type(longest);
  make_group_of(description.path);
  const hsize_t count = texts.size();
  const Handle space(check(H5Screate_simple(1, &count, nullptr), "shape"), H5Sclose);
  const Handle creation(check(H5Pcreate(H5P_DATASET_CREATE), "dataset creation"), H5Pclose);
  check_done(H5Pset_obj_track_times(creation, 0), "times");
  const Handle dataset(
      check(H5Dcreate2(file_, description.path.c_str(), type, space, H5P_DEFAULT, creation, H5P_DEFAULT),
            description.path.c_str()),
      H5Dclose);
  if (!texts.empty()) {
    check_done(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()), description.path.c_str());
  }
  describe(dataset, description);
}

void Hdf5Writer::describe(Hdf5Id object, const Hdf5Description& description) {
  text_attribute(object, "unit", description.unit);
  text_attribute(object, "shape", description.shape);
  if (!description.frame.empty()) text_attribute(object, "frame", description.frame);
  text_attribute(object, "meaning", description.meaning);
}

void Hdf5Writer::text_attribute(Hdf5Id object, const std::string& name, const std::string& value) {
  const auto held = hold();
  const Handle type = text_type(value.size());
  const Handle space(check(H5Screate(H5S_SCALAR), "attribute"), H5Sclose);
  const Handle attribute(check(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), name.c_str()),
                         H5Aclose);
  check_done(H5Awrite(attribute, type, value.c_str()), name.c_str());
}

void Hdf5Writer::set_attribute(const std::string& name, const std::string& value) {
  const auto held = hold();
  text_attribute(file_, name, value);
}

void Hdf5Writer::set_attribute(const std::string& name, std::int64_t value) {
  const auto held = hold();
  const Handle space(check(H5Screate(H5S_SCALAR), "attribute"), H5Sclose);
  const Handle attribute(
      check(H5Acreate2(file_, name.c_str(), H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), name.c_str()), H5Aclose);
  check_done(H5Awrite(attribute, H5T_NATIVE_INT64, &value), name.c_str());
}

void Hdf5Writer::close() {
  close({});
}

void Hdf5Writer::close(const std::function<std::string(std::string_view rest)>& head) {
  const auto held = hold();
  for (auto& [path, dataset] : datasets_) H5Dclose(dataset.id);
  datasets_.clear();
  check_done(H5Fflush(file_, H5F_SCOPE_GLOBAL), "flush");
  const ssize_t size = H5Fget_file_image(file_, nullptr, 0);  // without the user block
  void* memory = nullptr;  // the image's own copy has a wrong checksum in its superblock (HDF5 1.10.8)
  if (size < 0 || H5Fget_vfd_handle(file_, H5P_DEFAULT, &memory) < 0) fail("{}: can't be written (its memory)", name_);
  hsize_t user_block = 0;
  const Handle creation(check(H5Fget_create_plist(file_), "user block"), H5Pclose);
  check_done(H5Pget_userblock(creation, &user_block), "user block");
  const std::string_view rest(*static_cast<const char* const*>(memory) + user_block, static_cast<std::size_t>(size));
  std::string before = head ? head(rest) : std::string();
  TS_ASSERT(before.size() <= user_block);
  before.resize(user_block, '\0');
  std::ofstream out(name_, std::ios::binary);
  out.write(before.data(), static_cast<std::streamsize>(before.size()));
  out.write(rest.data(), static_cast<std::streamsize>(rest.size()));
  out.close();
  const int why = errno;
  check_done(H5Fclose(std::exchange(file_, -1)), "closing the file");
  if (!out) fail("{}: can't be written ({})", name_, std::strerror(why));
}

Hdf5Reader::Hdf5Reader(const std::filesystem::path& file) : name_(file.string()) {
  const auto held = hold();
  keep_hdf5_quiet();
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) fail("{}: there is no such file", name_);
  file_ = H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file_ < 0) fail("{}: isn't an HDF5 file, or is broken off", name_);
}

Hdf5Reader::~Hdf5Reader() {
  const auto held = hold();
  H5Fclose(file_);
}

bool Hdf5Reader::has(const std::string& path) const {
  const auto held = hold();
  return H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
}

bool Hdf5Reader::has_attribute(const std::string& path, const std::string& name) const {
  const auto held = hold();
  return H5Aexists_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

std::vector<std::int64_t> Hdf5Reader::shape_of(const std::string& path, std::size_t& size) const {
  const auto held = hold();
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (dataset < 0) fail("{}: has no dataset '{}'", name_, path);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank < 0) fail("{}: '{}' isn't an array", name_, path);
  std::vector<hsize_t> extent(static_cast<std::size_t>(rank));
  if (rank > 0) H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  size = 1;
  for (const hsize_t part : extent) {
    if (__builtin_mul_overflow(size, part, &size)) fail("{}: '{}' has more values than 64 bits count", name_, path);
  }
  // An array of any size fits in a small file if its numbers aren't there: HDF5 makes them up as they're read.
  if (size > 0 && !is_all_there(path, size)) {
    fail("{}: '{}' says that it holds {} numbers, but not all of them are in the file", name_, path, size);
  }
  return {extent.begin(), extent.end()};
}

void Hdf5Reader::read_into(const std::string& path, Hdf5Id type, void* values) const {
  const auto held = hold();
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0) {
    fail("{}: '{}' can't be read; it isn't of the kind that is needed, or the file is damaged", name_, path);
  }
}

std::vector<std::int64_t> Hdf5Reader::shape_of_rows(const std::string& path, std::int64_t first, std::int64_t count,
                                                    std::size_t& size) const {
  std::vector<std::int64_t> shape = shape_of(path, size);
  if (shape.empty() || first < 0 || count < 0 || first > shape[0] || count > shape[0] - first) {
    fail("{}: '{}' has {} rows; wanted are {} from {} on", name_, path, shape.empty() ? 0 : shape[0], count, first);
  }
  shape[0] = count;
  size = 1;
  for (const std::int64_t part : shape) size *= static_cast<std::size_t>(part);
  return shape;
}

void Hdf5Reader::read_row_part(const std::string& path, Hdf5Id type, std::int64_t first,
                               const std::vector<std::int64_t>& shape, void* values) const {
  const auto held = hold();
  const std::vector<hsize_t> extent(shape.begin(), shape.end());
  std::vector<hsize_t> start(shape.size(), 0);
  start[0] = static_cast<hsize_t>(first);
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle place(H5Dget_space(dataset), H5Sclose);
  const Handle memory(H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(place, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr) < 0 ||
      H5Dread(dataset, type, memory, place, H5P_DEFAULT, values) < 0) {
    fail("{}: rows {} to {} of '{}' can't be read; it isn't of the kind that is needed, or the file is damaged", name_,
         first, first + shape[0] - 1, path);
  }
}

void Hdf5Reader::expect_whole_numbers(const std::string& path) const {
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (dataset < 0) fail("{}: has no dataset '{}'", name_, path);
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type);
  if (kind != H5T_INTEGER && kind != H5T_ENUM) fail("{}: '{}' doesn't hold whole numbers", name_, path);
  const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    std::size_t values = 0;
    std::array<char, 64> called{};
    unsigned config = 0;
    const H5Z_filter_t filter = H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values, nullptr,
                                               called.size(), called.data(), &config);
    if (filter >= 0 && H5Zfilter_avail(filter) > 0) continue;
    called.back() = '\0';
    fail(
        "{}: '{}' is packed by HDF5's filter {} ('{}'), which isn't on this machine. Plugins bring it: Blosc (32001) "
        "is "
        "Debian's hdf5-filter-plugin-blosc-serial; HDF5_PLUGIN_PATH names the folder that they are in",
        name_, path, static_cast<int>(filter), called.data());
  }
}

bool Hdf5Reader::is_all_there(const std::string& path, std::size_t count) const {
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
  if (H5Pget_layout(creation) != H5D_CHUNKED) {
    const Handle type(H5Dget_type(dataset), H5Tclose);
    return H5Dget_storage_size(dataset) / std::max<std::size_t>(1, H5Tget_size(type)) >= count;
  }
  // Not by H5Dget_space_status, which takes packed chunks for missing ones.
  const Handle space(H5Dget_space(dataset), H5Sclose);
  std::array<hsize_t, H5S_MAX_RANK> sides{};
  const int axes = H5Pget_chunk(creation, H5S_MAX_RANK, sides.data());
  hsize_t numbers_a_chunk = 1;
  for (int axis = 0; axis < axes; ++axis) {
    if (__builtin_mul_overflow(numbers_a_chunk, sides[static_cast<std::size_t>(axis)], &numbers_a_chunk)) return false;
  }
  hsize_t chunks = 0;
  return axes > 0 && numbers_a_chunk > 0 && H5Dget_num_chunks(dataset, space, &chunks) >= 0 &&
         (count - 1) / numbers_a_chunk < chunks;
}

std::int64_t Hdf5Reader::read_number(const std::string& path) const {
  const auto held = hold();
  expect_whole_numbers(path);
  std::size_t count = 0;
  shape_of(path, count);
  if (count != 1) fail("{}: '{}' holds {} numbers; allowed is one", name_, path, count);
  std::int64_t value = 0;
  read_into(path, H5T_NATIVE_INT64, &value);
  return value;
}

std::int64_t Hdf5Reader::count_of_whole_numbers(const std::string& path) const {
  const auto held = hold();
  expect_whole_numbers(path);
  std::size_t count = 0;
  const std::vector<std::int64_t> shape = shape_of(path, count);
  if (shape.size() != 1) fail("{}: '{}' has {} axes; allowed is one", name_, path, shape.size());
  return shape[0];
}

void Hdf5Reader::walk_list(const std::string& path) const {
  const auto held = hold();
  if (count_of_whole_numbers(path) == 0) return;
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  H5Dget_storage_size(dataset);  // visits every entry of the index of chunks
  std::int64_t first = 0;
  read_list_part(path, H5T_NATIVE_INT64, 0, 1, &first);  // and every filter
}

void Hdf5Reader::walk_rows(const std::string& path) const {
  const auto held = hold();
  const std::vector<std::int64_t> shape = extents(path);
  if (shape.empty() || shape[0] == 0) return;
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  H5Dget_storage_size(dataset);
  read_rows<double>(path, 0, 1);
}

void Hdf5Reader::read_list_part(const std::string& path, Hdf5Id type, std::int64_t first, std::int64_t count,
                                void* values) const {
  const auto held = hold();
  if (count == 0) return;
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle place(H5Dget_space(dataset), H5Sclose);
  const auto start = static_cast<hsize_t>(first);
  const auto extent = static_cast<hsize_t>(count);
  const Handle memory(H5Screate_simple(1, &extent, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(place, H5S_SELECT_SET, &start, nullptr, &extent, nullptr) < 0 ||
      H5Dread(dataset, type, memory, place, H5P_DEFAULT, values) < 0) {
    fail("{}: numbers {} to {} of '{}' can't be read; the file is damaged", name_, first, first + count - 1, path);
  }
}

std::vector<std::string> Hdf5Reader::read_texts(const std::string& path) const {
  const auto held = hold();
  std::size_t count = 0;
  shape_of(path, count);
  const Handle dataset(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle type(H5Dget_type(dataset), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) {
    fail("{}: '{}' doesn't hold texts of fixed length", name_, path);
  }
  const std::size_t length = H5Tget_size(type);
  std::vector<char> padded(length * count);
  if (count > 0 && H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) < 0) {
    fail("{}: '{}' can't be read", name_, path);
  }
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string padded_text(padded.data() + i * length, length);
    texts.push_back(padded_text.substr(0, padded_text.find('\0')));
  }
  return texts;
}

void Hdf5Reader::expect_one_value(Hdf5Id attribute, const std::string& path, const std::string& name) const {
  const Handle space(H5Aget_space(attribute), H5Sclose);
  const hssize_t values = H5Sget_simple_extent_npoints(space);
  if (values != 1) fail("{}: the attribute '{}' of '{}' has {} values; allowed is one", name_, name, path, values);
}

std::string Hdf5Reader::text_attribute(const std::string& path, const std::string& name) const {
  const auto held = hold();
  const Handle attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute < 0) fail("{}: '{}' has no attribute '{}'", name_, path, name);
  const Handle type(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) {
    fail("{}: the attribute '{}' of '{}' isn't a text of fixed length", name_, name, path);
  }
  expect_one_value(attribute, path, name);
  const std::size_t length = H5Tget_size(type);
  if (length > kMostTextBytes) {
    fail("{}: the attribute '{}' of '{}' is a text of {} bytes; allowed are {}", name_, name, path, length,
         kMostTextBytes);
  }
  std::string value(length, '\0');
  if (H5Aread(attribute, type, value.data()) < 0) fail("{}: attribute '{}' can't be read", name_, name);
  return value.substr(0, value.find('\0'));
}

std::int64_t Hdf5Reader::integer_attribute(const std::string& path, const std::string& name) const {
  const auto held = hold();
  const Handle attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute >= 0) expect_one_value(attribute, path, name);
  std::int64_t value = 0;
  if (attribute < 0 || H5Aread(attribute, H5T_NATIVE_INT64, &value) < 0) {
    fail("{}: '{}' has no whole number '{}'", name_, path, name);
  }
  return value;
}

void try_hdf5(const std::filesystem::path& file, const std::function<void()>& read) {
  const auto held = hold();
  std::string fault;
  try {
    fault = isolated_call(
        [&read]() -> std::string {
          try {
            read();
          } catch (const Error& error) {
            return error.what();
          }
          return {};
        },
        kTrialSeconds, kTrialSeconds);
  } catch (const Error& error) {
    fail("{}: is damaged (HDF5 failed to read it: {})", file.string(), error.what());
  }
  if (!fault.empty()) throw Error(fault);
}

}  // namespace touchstone
