/* Lets the guest kernel save the registers of processors that it does not know.
 *
 * Linux 6.1 as user-mode Linux saves the extended state of a process (XSAVE) in 2,696 bytes. On a processor
 * with AMX that state has 11,008 bytes, and the host refuses to set less than all of it (PTRACE_SETREGSET with
 * NT_X86_XSTATE): the guest dies at its first process. Loaded by LD_PRELOAD, this completes what the guest
 * leaves out with what the process has now. Later kernels ask for the size themselves. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

/* Static, because the guest's stacks are small. The guest is a single thread where it sets registers. */
static char state[1 << 16] __attribute__((aligned(64)));

long ptrace(enum __ptrace_request request, ...)
{
    static long (*libc_ptrace)(enum __ptrace_request, ...);
    if (!libc_ptrace)
        libc_ptrace = (long (*)(enum __ptrace_request, ...))dlsym(RTLD_NEXT, "ptrace");

    va_list arguments;
    va_start(arguments, request);
    pid_t pid = va_arg(arguments, pid_t);
    void *address = va_arg(arguments, void *);
    void *data = va_arg(arguments, void *);
    va_end(arguments);

    if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
        const struct iovec *given = data;
        struct iovec whole = { state, sizeof state };
        if (libc_ptrace(PTRACE_GETREGSET, pid, address, &whole) == 0 && whole.iov_len > given->iov_len) {
            memcpy(state, given->iov_base, given->iov_len);
            return libc_ptrace(request, pid, address, &whole);
        }
    }
    return libc_ptrace(request, pid, address, data);
}
