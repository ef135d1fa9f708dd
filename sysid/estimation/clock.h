#pragma once

namespace sysid {

// Seconds of a steady clock.
double Now();
// Processor seconds of this process so far, all threads together.
double CpuSeconds();

}  // namespace sysid
