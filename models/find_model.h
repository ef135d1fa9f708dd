#pragma once

#include <string>
#include <vector>

namespace sysid {

// The file of --model: what holds a '/' or ends in ".urdf" is a file and comes
// back as it is; anything else is the name of a shipped robot, looked for in
// $SYSID_DATA_DIR/robots, in the source tree's data/robots, beside the program
// and the shared library that this is part of (../share/sysid/robots) and in
// the installation. Throws InputError at "--model" for an unknown name, with
// the nearest shipped one.
std::string FindModel(const std::string& name_or_file);

// Names of the robots in those folders, sorted.
std::vector<std::string> ShippedModels();

}  // namespace sysid
