// Counts the instructions that QEMU executes: a plugin of its version 1 interface (QEMU 4.2 to 8), which is declared here
// because Debian ships no header. The number at the end is written to the file that INSTRUCTIONS names, and before it a
// line for each time that the program asks for its parent, which nobody else does: that is how it marks a place.
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#define EXPORTED __attribute__((visibility("default")))

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum operation { ADD_U64 };

void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, void (*)(plugin_id, struct qemu_plugin_tb *));
void qemu_plugin_register_atexit_cb(plugin_id, void (*)(plugin_id, void *), void *);
typedef void syscall_callback(plugin_id, unsigned, int64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t,
                              uint64_t, uint64_t);
void qemu_plugin_register_vcpu_syscall_cb(plugin_id, syscall_callback *);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
void qemu_plugin_register_vcpu_insn_exec_inline(struct qemu_plugin_insn *, enum operation, void *, uint64_t);

EXPORTED int qemu_plugin_version = 1;

static uint64_t n_executed;

static void count_block(plugin_id id, struct qemu_plugin_tb *block) {
    size_t n = qemu_plugin_tb_n_insns(block);
    for (size_t i = 0; i < n; i++)
        qemu_plugin_register_vcpu_insn_exec_inline(qemu_plugin_tb_get_insn(block, i), ADD_U64, &n_executed, 1);
}

// The number of getppid on 64-bit ARM.
static const int64_t MARK = 173;
static FILE *file;

static void tell(void) { fprintf(file, "%llu\n", (unsigned long long)n_executed); }

static void note_call(plugin_id id, unsigned processor, int64_t number, uint64_t a, uint64_t b, uint64_t c, uint64_t d,
                      uint64_t e, uint64_t f, uint64_t g, uint64_t h) {
    if (number == MARK)
        tell();
}

static void end(plugin_id id, void *nothing) {
    tell();
    fclose(file);
}

EXPORTED int qemu_plugin_install(plugin_id id, const void *info, int n_arguments, char **arguments) {
    const char *path = getenv("INSTRUCTIONS");
    file = path ? fopen(path, "w") : NULL;
    if (!file) {
        fprintf(stderr, "instructions: expected INSTRUCTIONS to name a file that can be written\n");
        return 1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, count_block);
    qemu_plugin_register_vcpu_syscall_cb(id, note_call);
    qemu_plugin_register_atexit_cb(id, end, NULL);
    return 0;
}
