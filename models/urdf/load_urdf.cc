#include "models/urdf/load_urdf.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "models/error.h"
#include "models/urdf/urdf_outline.h"
#include "models/urdf/urdf_tree.h"

namespace sysid {

Mechanism LoadUrdf(const std::string& path) {
  constexpr size_t kMostText = size_t{64} << 20;
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path, "is a folder, not a URDF file", "name a file in it");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path,
                     std::string("cannot be read: ") + std::strerror(errno),
                     "give a URDF file or the name of a shipped model");
  }
  std::string text;
  std::vector<char> chunk(1 << 16);
  // Text has no NUL: stops there, for /dev/zero has no end.
  for (size_t read = 0; file && text.find('\0', read) == std::string::npos;) {
    read = text.size();
    if (read > kMostText) {
      throw InputError(path, "is larger than 64 MiB",
                       "is this the URDF that you mean? Meshes stand in files "
                       "of their own");
    }
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    text.append(chunk.data(), static_cast<size_t>(file.gcount()));
  }
  return LoadUrdfText(text, path);
}

Mechanism LoadUrdfText(const std::string& text, const std::string& path) {
  const UrdfOutline outline = ReadUrdfOutline(text, path);
  const std::vector<UrdfLink>& links = outline.links;
  Mechanism mechanism;
  mechanism.name = outline.robot_name;
  std::vector<int> index(links.size(), -1);  // of the outline's links
  index[outline.root] = mechanism.AddRoot(links[outline.root].name);
  mechanism.nominal.links[0] = links[outline.root].body;
  for (int j : ParentsFirst(outline)) {
    const UrdfJoint& read = outline.joints[j];
    const UrdfLink& child = links[read.child_link];
    Joint joint = read;
    joint.parent_link = index[read.parent_link];
    const int added =
        mechanism.AddJoint(joint, child.name, read.p_PJ, child.body);
    index[read.child_link] = mechanism.joints[added].child_link;
  }
  return mechanism;
}

}  // namespace sysid
