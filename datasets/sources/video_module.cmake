# The module that alone links FFmpeg, for videos, read and written, and addresses, and OpenCV's videoio, for cameras; touchstone_datasets
# opens it when the first of them is read (opened_video_module.cpp). To load these libraries takes 0.13 s.
touchstone_need_ffmpeg()
touchstone_need_opencv(core videoio)

add_library(touchstone_video_module MODULE
  "${CMAKE_CURRENT_LIST_DIR}/ffmpeg_words.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/video_module.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/video_camera.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/video_reader.cpp"
  "${CMAKE_CURRENT_LIST_DIR}/video_writer.cpp")
target_include_directories(touchstone_video_module PRIVATE "${PROJECT_SOURCE_DIR}")
target_link_libraries(touchstone_video_module PRIVATE FFmpeg::FFmpeg opencv_core opencv_videoio touchstone_options)
target_compile_features(touchstone_video_module PRIVATE cxx_std_20)
set_target_properties(touchstone_video_module PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden UNITY_BUILD OFF)

set(_module_name "touchstone_video_module${CMAKE_SHARED_MODULE_SUFFIX}")
set_source_files_properties("${CMAKE_CURRENT_LIST_DIR}/opened_video_module.cpp" TARGET_DIRECTORY touchstone_datasets PROPERTIES COMPILE_DEFINITIONS
  "TOUCHSTONE_VIDEO_MODULE_NAME=\"${_module_name}\";TOUCHSTONE_VIDEO_MODULE_BUILT=\"${CMAKE_CURRENT_BINARY_DIR}/${_module_name}\"")
set_target_properties(touchstone_video_module PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
add_dependencies(touchstone_datasets touchstone_video_module)
install(TARGETS touchstone_video_module LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/touchstone")
