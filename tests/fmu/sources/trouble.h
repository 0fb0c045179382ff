/* y = (a*x + b)*(1 - exp(-t)); where x > above at t > 0.5 it misbehaves as the enumeration `how` says.
   mixed: it crashes there, hangs where x > hang, and each trial leaks 20 kB. */
enum { V_Xp, V_A, V_B, V_ABOVE, V_HANG, VR_X, VR_DX = VR_X + 1, V_Y = VR_DX + 1, NR };
#define NI 2   /* 100: how, 101: unused */
#define NB 1
#define NS 1   /* 300: label */
#define NX 1
#define NZ 0
#define H_INNER 1e-2
#define GUID "{7b0b1e00-0000-4000-8000-00000000000a}"
#define FIXED(v) ((v) <= V_HANG)
enum { FINE = 1, CRASH, HANG, LEAK, PRINT, EXIT, ABORT, END_EARLY, ERROR_, NAN_, STACK, THROW_AWAY, SLEEP, MIXED, FATAL_ };
#include "tiny.h"
static void m_start(Inst *m) {
  memset(m->r, 0, sizeof m->r);
  m->r[V_A] = 2; m->r[V_B] = 1; m->r[V_ABOVE] = 1; m->r[V_HANG] = 4; m->i[0] = FINE; m->b[0] = 0; strcpy(m->s[0], "x"); m->t = 0; m->terminate = 0; }
static int m_init(Inst *m) {
  if (m->i[0] == MIXED) { char *leak = malloc(20 << 10); if (leak) memset(leak, 1, 20 << 10); }
  return 0; }
static volatile int sink;
static int deep(int n) { volatile char big[4096]; big[0] = n; return n > 1000000000 ? big[0] : deep(n + 1) + big[0]; }
static int m_rhs(Inst *m) {
  m->r[VR_DX] = 1 - m->r[VR_X]; m->r[V_Y] = (m->r[V_A] * m->r[V_Xp] + m->r[V_B]) * m->r[VR_X];
  if (m->t > 0.5 && m->r[V_Xp] > m->r[V_ABOVE]) switch (m->i[0]) {
    case CRASH: *(volatile int *)0 = 1; break;
    case HANG: for (;;) sink++;
    case SLEEP: for (;;) sleep(1000);
    case LEAK: { char *p = malloc(1 << 20); if (p) memset(p, 1, 1 << 20); else abort(); break; }
    case PRINT: printf("noise on stdout\n"); fflush(stdout); fprintf(stderr, "noise on stderr\n"); break;
    case EXIT: exit(0);
    case ABORT: abort();
    case END_EARLY: m->terminate = 1; break;
    case ERROR_: return 3;
    case NAN_: m->r[V_Y] = NAN; m->r[VR_DX] = NAN; break;
    case STACK: sink = deep(0); break;
    case THROW_AWAY: return 2;
    case FATAL_: return 4;
    case MIXED: if (m->r[V_Xp] > m->r[V_HANG]) for (;;) sink++; *(volatile int *)0 = 1;
  }
  return 0;
}
static void m_zero(Inst *m, double *z) { (void)m; (void)z; }
static int m_event(Inst *m) { (void)m; return 0; }
static int m_accepted(Inst *m) { (void)m; return 0; }
