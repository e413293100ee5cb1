# One function per outside library: it finds it, or stops with the name of the Debian package that brings it.
# A folder's CMakeLists.txt calls those it needs, so a part asks for nothing that it doesn't link. What the folder of a
# library asks for is noted there, and an installed Touchstone asks for it again (TouchstoneInstall.cmake).

# Notes a call for the folder that is being read.
function(touchstone_note_need macro)
  list(JOIN ARGN "\" \"" arguments)
  set_property(DIRECTORY APPEND PROPERTY TOUCHSTONE_NEEDS "${macro}(\"${arguments}\")")
endfunction()

macro(touchstone_missing library package)
  message(FATAL_ERROR "${library} was not found. Install Debian's '${package}' "
                      "(script/bootstrap installs all that Touchstone needs).")
endmacro()

macro(touchstone_require_package library package)
  find_package(${library} QUIET ${ARGN})
  if(NOT ${library}_FOUND)
    touchstone_missing("${library}" "${package}")
  endif()
  touchstone_note_need(touchstone_require_package "${library}" "${package}" ${ARGN})
endmacro()

macro(touchstone_need_eigen)
  touchstone_require_package(Eigen3 libeigen3-dev NO_MODULE)
endmacro()

macro(touchstone_need_fmt)
  touchstone_require_package(fmt libfmt-dev)
endmacro()

macro(touchstone_need_spdlog)
  touchstone_require_package(spdlog libspdlog-dev)
endmacro()

macro(touchstone_need_yaml)
  touchstone_require_package(yaml-cpp libyaml-cpp-dev)
endmacro()

macro(touchstone_need_json)
  touchstone_require_package(nlohmann_json nlohmann-json3-dev)
endmacro()

macro(touchstone_need_opencv)
  touchstone_require_package(OpenCV libopencv-dev COMPONENTS ${ARGN})
endmacro()

macro(touchstone_need_threads)
  touchstone_require_package(Threads libc6-dev)
endmacro()

macro(touchstone_need_tbb)
  touchstone_require_package(TBB libtbb-dev)
endmacro()

macro(touchstone_need_embree)
  touchstone_require_package(embree libembree-dev 3)
endmacro()

macro(touchstone_need_openimageio)
  touchstone_require_package(OpenImageIO "libopenimageio-dev openimageio-tools")
endmacro()

macro(touchstone_need_openssl)
  touchstone_require_package(OpenSSL libssl-dev)
endmacro()

macro(touchstone_need_archive)
  touchstone_plain_library(LibArchive::Archive libarchive-dev archive.h archive)
endmacro()

# Not noted: it is linked by its path, and CMake finds it only in projects that have C.
macro(touchstone_need_hdf5)
  set(HDF5_PREFER_PARALLEL FALSE)
  find_package(HDF5 QUIET COMPONENTS C HL)
  if(NOT HDF5_FOUND)
    touchstone_missing(HDF5 libhdf5-dev)
  endif()
endmacro()

macro(touchstone_need_zlib)
  touchstone_require_package(ZLIB zlib1g-dev)
endmacro()

macro(touchstone_need_cli11)
  touchstone_require_package(CLI11 libcli11-dev)
endmacro()

macro(touchstone_need_gtest)
  touchstone_require_package(GTest "libgtest-dev libgmock-dev")
endmacro()

macro(touchstone_need_benchmark)
  touchstone_require_package(benchmark libbenchmark-dev)
endmacro()

# Libraries without a CMake config: header and library are looked up, an imported target is made.
macro(touchstone_plain_library target package header)
  touchstone_note_need(touchstone_plain_library "${target}" "${package}" "${header}" ${ARGN})
  if(NOT TARGET ${target})
    string(MAKE_C_IDENTIFIER "${target}" _id)
    find_path(${_id}_INCLUDE ${header})
    set(_links "")
    foreach(_name ${ARGN})
      find_library(${_id}_${_name}_LIBRARY ${_name})
      if(NOT ${_id}_${_name}_LIBRARY)
        touchstone_missing("${_name}" "${package}")
      endif()
      list(APPEND _links "${${_id}_${_name}_LIBRARY}")
    endforeach()
    if(NOT ${_id}_INCLUDE)
      touchstone_missing("${header}" "${package}")
    endif()
    add_library(${target} INTERFACE IMPORTED)
    target_include_directories(${target} SYSTEM INTERFACE "${${_id}_INCLUDE}")
    target_link_libraries(${target} INTERFACE ${_links})
  endif()
endmacro()

macro(touchstone_need_random123)
  touchstone_plain_library(Random123::Random123 librandom123-dev Random123/philox.h)
endmacro()

macro(touchstone_need_tetgen)
  touchstone_plain_library(TetGen::TetGen libtet1.5-dev tetgen.h tet)
endmacro()

macro(touchstone_need_mumps)
  touchstone_plain_library(Mumps::Mumps libmumps-seq-dev dmumps_c.h dmumps_seq mumps_common_seq)
endmacro()

macro(touchstone_need_openblas)
  touchstone_plain_library(OpenBLAS::OpenBLAS libopenblas-dev openblas_config.h openblas)
endmacro()

macro(touchstone_need_fftw)
  touchstone_plain_library(FFTW::FFTW libfftw3-dev fftw3.h fftw3)
endmacro()

macro(touchstone_need_spectra)
  touchstone_plain_library(Spectra::Headers libspectra-dev Spectra/SymGEigsShiftSolver.h)
endmacro()

macro(touchstone_need_tinygltf)
  touchstone_plain_library(TinyGLTF::Headers libtinygltf-dev tiny_gltf.h tinygltf)
endmacro()

macro(touchstone_need_assimp)
  touchstone_plain_library(Assimp::Assimp libassimp-dev assimp/Importer.hpp assimp)
endmacro()

macro(touchstone_need_tiff)
  touchstone_plain_library(Tiff::Tiff libtiff-dev tiffio.h tiff)
endmacro()

macro(touchstone_need_turbojpeg)
  touchstone_plain_library(TurboJpeg::TurboJpeg libturbojpeg0-dev turbojpeg.h turbojpeg)
endmacro()

macro(touchstone_need_httplib)
  touchstone_plain_library(HttpLib::HttpLib libcpp-httplib-dev httplib.h cpp-httplib)
  # Debian's library was compiled with them, and a request's layout depends on the first.
  set_target_properties(HttpLib::HttpLib PROPERTIES INTERFACE_COMPILE_DEFINITIONS
    "CPPHTTPLIB_OPENSSL_SUPPORT;CPPHTTPLIB_ZLIB_SUPPORT;CPPHTTPLIB_BROTLI_SUPPORT")
endmacro()

# Not noted: only the video module links it, which is opened by its name.
macro(touchstone_need_ffmpeg)
  if(NOT TARGET FFmpeg::FFmpeg)
    find_path(FFmpeg_INCLUDE libavformat/avformat.h)
    foreach(_name avformat avcodec avutil swscale)
      find_library(FFmpeg_${_name}_LIBRARY ${_name})
      if(NOT FFmpeg_${_name}_LIBRARY OR NOT FFmpeg_INCLUDE)
        touchstone_missing("FFmpeg's lib${_name}" "lib${_name}-dev")
      endif()
    endforeach()
    add_library(FFmpeg::FFmpeg INTERFACE IMPORTED)
    target_include_directories(FFmpeg::FFmpeg SYSTEM INTERFACE "${FFmpeg_INCLUDE}")
    target_link_libraries(FFmpeg::FFmpeg INTERFACE "${FFmpeg_avformat_LIBRARY}" "${FFmpeg_avcodec_LIBRARY}"
      "${FFmpeg_avutil_LIBRARY}" "${FFmpeg_swscale_LIBRARY}")
  endif()
endmacro()

macro(touchstone_need_xxhash)
  touchstone_plain_library(XXHash::XXHash libxxhash-dev xxhash.h xxhash)
endmacro()

macro(touchstone_need_flatbuffers)
  touchstone_plain_library(FlatBuffers::Headers libflatbuffers-dev flatbuffers/flatbuffers.h)
endmacro()

macro(touchstone_need_lz4)
  touchstone_plain_library(LZ4::LZ4 liblz4-dev lz4frame.h lz4)
endmacro()

macro(touchstone_need_zstd)
  touchstone_plain_library(Zstd::Zstd libzstd-dev zstd.h zstd)
endmacro()

macro(touchstone_need_pugixml)
  touchstone_plain_library(PugiXML::PugiXML libpugixml-dev pugixml.hpp pugixml)
endmacro()

# Debian's Python, whatever else is called python3 on the machine.
macro(touchstone_need_python)
  set(Python_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that the package `touchstone` is for")
  find_package(Python QUIET COMPONENTS Interpreter Development.Module NumPy)
  if(NOT Python_Development.Module_FOUND)
    touchstone_missing("Python's headers" python3-dev)
  endif()
  if(NOT Python_NumPy_FOUND)
    touchstone_missing(NumPy python3-numpy)
  endif()
  touchstone_require_package(pybind11 pybind11-dev)
endmacro()
