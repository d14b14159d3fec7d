/* A library for LD_PRELOAD in a process that draws by llvmpipe. It makes an unlikely moment likely:
 * a thread of llvmpipe has counted itself on a fence, but has not unlocked the fence yet. In about
 * one of five such moments, the thread sleeps for 0.6 ms; `checked` counts these sleeps. Other
 * threads sleep for 0.15 ms after about one of forty unlockings of a mutex. `freed` counts fences
 * that were freed during a sleep. Their memory is kept, so the process does not crash. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

extern void __libc_free(void *);

/* In struct lp_fence, 8 bytes precede the mutex, and the condition variable follows the mutex. */
enum { BEFORE_MUTEX = 8, OWNER = 2 };

int checked, freed;
static void *volatile signalled[64];    /* the fence of each sleeping thread */

static int thread_number(void) {    /* n for "llvmpipe-n", -1 for other threads */
  static __thread int number = -2;
  if (number == -2) {
    char name[17] = {0};
    prctl(PR_GET_NAME, name);
    number = strncmp(name, "llvmpipe-", 9) ? -1 : atoi(name + 9) % 64;
  }
  return number;
}

void free(void *memory) {
  for (int i = 0; memory && i < 64; i++)
    if (signalled[i] == memory) {
      freed++;
      return;
    }
  __libc_free(memory);
}

int pthread_mutex_unlock(pthread_mutex_t *mutex) {
  static int (*next)(pthread_mutex_t *);
  static unsigned seed = 7;
  if (!next) next = dlsym(RTLD_NEXT, "pthread_mutex_unlock");
  int result = next(mutex);
  if (thread_number() < 0 && rand_r(&seed) % 40 == 0) usleep(150);
  return result;
}

int pthread_cond_broadcast(pthread_cond_t *condition) {
  static int (*next)(pthread_cond_t *);
  static __thread unsigned seed;
  if (!next) next = dlvsym(RTLD_NEXT, "pthread_cond_broadcast", "GLIBC_2.3.2");
  if (!next) next = dlsym(RTLD_NEXT, "pthread_cond_broadcast");
  if (!seed) seed = thread_number() + 1;
  if (thread_number() >= 0 && rand_r(&seed) % 5 == 0) {
    int *mutex = (int *)((char *)condition - sizeof(pthread_mutex_t));
    if (mutex[OWNER] == syscall(SYS_gettid)) {
      checked++;
      signalled[thread_number()] = (char *)mutex - BEFORE_MUTEX;
      usleep(600);
      signalled[thread_number()] = NULL;
    }
  }
  return next(condition);
}
