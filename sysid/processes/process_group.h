#pragma once

#include <functional>
#include <memory>

#include "sysid/estimation/processes.h"

namespace sysid {

// The processes of one program that mpirun or srun started together. The only
// code that calls MPI is behind this.
class ProcessGroup : public Processes,
                     public std::enable_shared_from_this<ProcessGroup> {
 public:
  // Null where this process was started by itself. Throws InputError where it
  // was not, but the build has no MPI.
  static std::shared_ptr<ProcessGroup> Join();

  // Does a program's work, which says its exit code, and returns that. Of all
  // the processes only the first one is heard: what others print is dropped.
  // Where one fails by itself its words are printed after all, with its number,
  // and the whole job ends, for the others would wait for it for ever.
  virtual int Run(const std::function<int()>& program) = 0;
  // To be called by the work where it is through all calls of Processes.
  virtual void Finish() = 0;

  // Cores of this machine for each of its processes.
  virtual int CoresEach() const = 0;
};

}  // namespace sysid
