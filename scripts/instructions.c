// Counts the instructions that QEMU executes: a plugin of its version 1 interface (QEMU 4.2 to 8), which is declared here
// because Debian ships no header. The file that INSTRUCTIONS names gets a line `all COUNT` and, for each of the patterns
// in FUNCTIONS, which spaces part, a line `PATTERN COUNT`: what was executed between the call of a function whose symbol
// it matches and its return. Of functions that call one another the outermost counts. One thread is to work at a time.
#include <fnmatch.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORTED __attribute__((visibility("default")))
#define PATTERNS_MAX 32
#define FUNCTIONS_MAX 256
// `ret`, which leaves a function.
#define RETURN 0xd65f03c0u

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum operation { ADD_U64 };
enum registers { NONE_OF_THEM };
typedef void (*executed)(unsigned, void *);

void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, void (*)(plugin_id, struct qemu_plugin_tb *));
void qemu_plugin_register_atexit_cb(plugin_id, void (*)(plugin_id, void *), void *);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb *, enum operation, void *, uint64_t);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *, executed, enum registers, void *);
const void *qemu_plugin_insn_data(const struct qemu_plugin_insn *);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *);
const char *qemu_plugin_insn_symbol(const struct qemu_plugin_insn *);

EXPORTED int qemu_plugin_version = 1;

// A function that a pattern matches.
struct function {
    const char *symbol;
    uint64_t entry;
    size_t pattern;
};

static uint64_t n_executed;
static char *patterns[PATTERNS_MAX];
static uint64_t n_within[PATTERNS_MAX];
static size_t n_patterns;
static struct function functions[FUNCTIONS_MAX];
static size_t n_functions;
static struct function *outermost;
static uint64_t n_before;

static void fail(const char *why) {
    fprintf(stderr, "instructions: %s\n", why);
    exit(1);
}

static void enter(unsigned processor, void *function) {
    // Whoever left by a jump into another function was not seen to leave.
    if (outermost == function)
        fail("expected a function to return before it is called again");
    if (outermost)
        return;
    outermost = function;
    n_before = n_executed;
}

static void leave(unsigned processor, void *function) {
    if (outermost != function)
        return;
    n_within[outermost->pattern] += n_executed - n_before;
    outermost = NULL;
}

// The function of a symbol that a pattern matches, which begins where it is met first; NULL for others.
static struct function *function_of(const char *symbol, uint64_t place) {
    for (size_t i = 0; i < n_functions; i++)
        if (strcmp(functions[i].symbol, symbol) == 0)
            return &functions[i];
    for (size_t i = 0; i < n_patterns; i++) {
        if (fnmatch(patterns[i], symbol, 0) != 0)
            continue;
        if (n_functions == FUNCTIONS_MAX)
            fail("expected fewer functions that the patterns match");
        functions[n_functions] = (struct function){symbol, place, i};
        return &functions[n_functions++];
    }
    return NULL;
}

static void watch(struct qemu_plugin_insn *instruction) {
    const char *symbol = qemu_plugin_insn_symbol(instruction);
    uint64_t place = qemu_plugin_insn_vaddr(instruction);
    struct function *function = symbol ? function_of(symbol, place) : NULL;
    if (!function)
        return;
    uint32_t word;
    memcpy(&word, qemu_plugin_insn_data(instruction), sizeof word);
    if (place == function->entry)
        qemu_plugin_register_vcpu_insn_exec_cb(instruction, enter, NONE_OF_THEM, function);
    if (word == RETURN)
        qemu_plugin_register_vcpu_insn_exec_cb(instruction, leave, NONE_OF_THEM, function);
}

static void count_block(plugin_id id, struct qemu_plugin_tb *block) {
    size_t n = qemu_plugin_tb_n_insns(block);
    qemu_plugin_register_vcpu_tb_exec_inline(block, ADD_U64, &n_executed, n);
    for (size_t i = 0; n_patterns > 0 && i < n; i++)
        watch(qemu_plugin_tb_get_insn(block, i));
}

static void tell(plugin_id id, void *nothing) {
    const char *path = getenv("INSTRUCTIONS");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (!file)
        fail("expected INSTRUCTIONS to name a file that can be written");
    fprintf(file, "all %llu\n", (unsigned long long)n_executed);
    for (size_t i = 0; i < n_patterns; i++)
        fprintf(file, "%s %llu\n", patterns[i], (unsigned long long)n_within[i]);
    fclose(file);
}

EXPORTED int qemu_plugin_install(plugin_id id, const void *info, int n_arguments, char **arguments) {
    const char *asked = getenv("FUNCTIONS");
    char *words = strdup(asked ? asked : "");
    for (char *word = strtok(words, " "); word; word = strtok(NULL, " ")) {
        if (n_patterns == PATTERNS_MAX)
            fail("expected fewer patterns in FUNCTIONS");
        patterns[n_patterns++] = word;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, count_block);
    qemu_plugin_register_atexit_cb(id, tell, NULL);
    return 0;
}
