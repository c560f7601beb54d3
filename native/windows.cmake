# A toolchain for Windows on x86-64, of Zig alone: cmake -D CMAKE_TOOLCHAIN_FILE=native/windows.cmake -D ZIG=path
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES ZIG)
set(CMAKE_CXX_ARCHIVE_CREATE "${ZIG} ar qcs <TARGET> <OBJECTS>")
set(CMAKE_CXX_ARCHIVE_FINISH "")
set(CMAKE_CXX_COMPILER ${ZIG})
set(CMAKE_CXX_COMPILER_ARG1 "c++ -target x86_64-windows-gnu")
set(CMAKE_CXX_COMPILER_LAUNCHER "")
set(RACECRAFT_CCACHE "")  # it would take the word c++ for a file
