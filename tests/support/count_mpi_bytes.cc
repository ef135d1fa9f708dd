// Preloaded into a program, counts by MPI's profiling interface what each
// process puts into reductions and broadcasts, and into messages, and writes it
// to the file "$COUNT_MPI_BYTES.RANK": two numbers, bytes.

#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <cstdio>
#include <cstdlib>

namespace {

double reduced = 0.0, sent = 0.0;

double BytesOf(int count, MPI_Datatype type) {
  int size = 0;
  PMPI_Type_size(type, &size);
  return static_cast<double>(count) * size;
}

}  // namespace

extern "C" {

int MPI_Reduce(const void* in, void* out, int count, MPI_Datatype type,
               MPI_Op op, int root, MPI_Comm comm) {
  reduced += BytesOf(count, type);
  return PMPI_Reduce(in, out, count, type, op, root, comm);
}

int MPI_Bcast(void* data, int count, MPI_Datatype type, int root,
              MPI_Comm comm) {
  (type == MPI_BYTE ? sent : reduced) += BytesOf(count, type);
  return PMPI_Bcast(data, count, type, root, comm);
}

int MPI_Send(const void* data, int count, MPI_Datatype type, int to, int tag,
             MPI_Comm comm) {
  sent += BytesOf(count, type);
  return PMPI_Send(data, count, type, to, tag, comm);
}

int MPI_Finalize() {
  int rank = 0;
  PMPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (const char* const name = std::getenv("COUNT_MPI_BYTES")) {
    char file[1024];
    std::snprintf(file, sizeof file, "%s.%d", name, rank);
    if (std::FILE* const out = std::fopen(file, "w")) {
      std::fprintf(out, "%.0f %.0f\n", reduced, sent);
      std::fclose(out);
    }
  }
  return PMPI_Finalize();
}
}
