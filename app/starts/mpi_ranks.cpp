#include "app/starts/ranks.hpp"

#include <cstdlib>
#include <stdexcept>

#ifdef MBSOPT_MPI
#include <dlfcn.h>
#include <fmt/format.h>
#include <mpi.h>  // with OMPI_SKIP_MPICXX: the C interface only

#if !defined(OPEN_MPI) || OMPI_MAJOR_VERSION < 3
#error "Open MPI 3 or later is needed: of others neither the library's name nor its handles are known here"
#endif
#endif

namespace mbsopt::inline app {
namespace {

bool started_by_mpirun() {
  const char* const size = std::getenv("OMPI_COMM_WORLD_SIZE");
  return size && std::atoi(size) > 1;
}

}  // namespace

#ifdef MBSOPT_MPI
namespace {

constexpr const char* kLibrary = "libmpi.so.40";  // of Open MPI 3, 4 and 5
constexpr int kTag = 1;

// Open MPI, which only ranks load. A plain run does not wait for it, and does not mix it with the MPI of MUMPS. That
// one (in libdmumps_seq, a substitute for one process) exports MPI_Init, MPI_Comm_rank, MPI_Finalize and MPI_Wtime,
// which MUMPS must find. If Open MPI were linked, it would come first. So
//   RTLD_DEEPBIND   Open MPI finds its own symbols first, not the substitute's;
//   RTLD_GLOBAL     its plugins find it, after all that the program was linked with.
class OpenMpi {
  void* library_ = ::dlopen(kLibrary, RTLD_NOW | RTLD_GLOBAL | RTLD_DEEPBIND);  // stays loaded until the process ends

  template <class Symbol>
  Symbol found(const char* name) const {
    if (!library_) throw std::runtime_error(fmt::format("Open MPI cannot be loaded: {}", ::dlerror()));
    void* const symbol = ::dlsym(library_, name);
    if (!symbol) throw std::runtime_error(fmt::format("{} has no {}", kLibrary, name));
    return reinterpret_cast<Symbol>(symbol);
  }

 public:
  decltype(&MPI_Init) init = found<decltype(&MPI_Init)>("MPI_Init");
  decltype(&MPI_Finalize) finalize = found<decltype(&MPI_Finalize)>("MPI_Finalize");
  decltype(&MPI_Comm_rank) comm_rank = found<decltype(&MPI_Comm_rank)>("MPI_Comm_rank");
  decltype(&MPI_Comm_size) comm_size = found<decltype(&MPI_Comm_size)>("MPI_Comm_size");
  decltype(&MPI_Send) send = found<decltype(&MPI_Send)>("MPI_Send");
  decltype(&MPI_Recv) recv = found<decltype(&MPI_Recv)>("MPI_Recv");
  decltype(&MPI_Iprobe) iprobe = found<decltype(&MPI_Iprobe)>("MPI_Iprobe");
  decltype(&MPI_Get_count) get_count = found<decltype(&MPI_Get_count)>("MPI_Get_count");
  MPI_Comm world = found<MPI_Comm>("ompi_mpi_comm_world");
  MPI_Datatype character = found<MPI_Datatype>("ompi_mpi_char");
};

class MpiRanks : public Ranks {
 public:
  MpiRanks() {
    mpi_.init(nullptr, nullptr);
    mpi_.comm_rank(mpi_.world, &rank_);
    mpi_.comm_size(mpi_.world, &size_);
  }
  ~MpiRanks() override { mpi_.finalize(); }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  void send(int to, const std::string& text) override {
    mpi_.send(text.data(), static_cast<int>(text.size()), mpi_.character, to, kTag, mpi_.world);
  }

  std::optional<Message> receive() override {
    int waiting = 0, length = 0;
    MPI_Status status;
    mpi_.iprobe(MPI_ANY_SOURCE, kTag, mpi_.world, &waiting, &status);
    if (!waiting) return std::nullopt;
    mpi_.get_count(&status, mpi_.character, &length);
    Message message{status.MPI_SOURCE, std::string(static_cast<std::size_t>(length), '\0')};
    mpi_.recv(message.text.data(), length, mpi_.character, status.MPI_SOURCE, kTag, mpi_.world, MPI_STATUS_IGNORE);
    return message;
  }

 private:
  const OpenMpi mpi_;
  int rank_ = 0, size_ = 1;
};

}  // namespace

std::unique_ptr<Ranks> mpi_ranks() {
  if (!started_by_mpirun()) return nullptr;
  return std::make_unique<MpiRanks>();
}
#else
std::unique_ptr<Ranks> mpi_ranks() {
  if (started_by_mpirun())
    throw std::runtime_error(
        "is one of several processes of mpirun, but was built without MPI: './dev setup --mpi', then build again; or "
        "run it without mpirun: --threads N uses all cores of one machine");
  return nullptr;
}
#endif

}  // namespace mbsopt::inline app
