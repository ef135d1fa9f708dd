#pragma once

#include <memory>
#include <string>

#include "sysid/io/byte_source.h"
#include "sysid/io/table_file.h"

namespace sysid {

// The messages sensor_msgs/JointState of one topic of a ROS 1 bag: a row a
// stamp, with the columns t (s, by the messages' stamps, from the first one)
// and J.q, J.qd, J.tau of each joint J that has a position, velocity, effort
// somewhere. Messages may have different joints: what is not in one is missing
// there; messages of one stamp and different joints are one row.
//
// `topic` "" is the only one of that type. Reads the bag once, for the joints.
// Throws InputError for a pipe, for what ReadBag refuses, for a bag with no
// such topic or several, and for a message that cannot be read.
std::unique_ptr<TableFile> OpenBagFile(ByteSource source,
                                       const std::string& topic);

}  // namespace sysid
