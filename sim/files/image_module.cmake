# The module that alone links OpenImageIO; touchstone_sim opens it when the first image file is read or written
# (image_file.cpp).
touchstone_need_openimageio()
touchstone_need_opencv(core imgproc)
touchstone_need_tiff()
touchstone_need_turbojpeg()
touchstone_need_zlib()

add_library(touchstone_image_module MODULE "${CMAKE_CURRENT_LIST_DIR}/image_module.cpp" "${CMAKE_CURRENT_LIST_DIR}/image_damage.cpp")
target_include_directories(touchstone_image_module PRIVATE "${PROJECT_SOURCE_DIR}")
# Their headers don't pass our warnings.
get_target_property(_oiio_headers OpenImageIO::OpenImageIO INTERFACE_INCLUDE_DIRECTORIES)
target_include_directories(touchstone_image_module SYSTEM PRIVATE ${_oiio_headers})
target_link_libraries(touchstone_image_module PRIVATE OpenImageIO::OpenImageIO Tiff::Tiff TurboJpeg::TurboJpeg ZLIB::ZLIB touchstone_options)
target_compile_features(touchstone_image_module PRIVATE cxx_std_20)
set_target_properties(touchstone_image_module PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden)

set(_module_name "touchstone_image_module${CMAKE_SHARED_MODULE_SUFFIX}")
set_source_files_properties("${CMAKE_CURRENT_LIST_DIR}/image_file.cpp" TARGET_DIRECTORY touchstone_sim PROPERTIES COMPILE_DEFINITIONS
  "TOUCHSTONE_IMAGE_MODULE_NAME=\"${_module_name}\";TOUCHSTONE_IMAGE_MODULE_BUILT=\"${CMAKE_CURRENT_BINARY_DIR}/${_module_name}\"")
set_target_properties(touchstone_image_module PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
target_link_libraries(touchstone_sim PRIVATE opencv_core opencv_imgproc ${CMAKE_DL_LIBS})
add_dependencies(touchstone_sim touchstone_image_module)
install(TARGETS touchstone_image_module LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/touchstone")
