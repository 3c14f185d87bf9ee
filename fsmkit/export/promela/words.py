"""Words that are reserved in Promela, or in the verifier that SPIN writes in C."""

from __future__ import annotations

from fsmkit.codegen.c.reserved import KEYWORDS, MACROS

_PROMELA = """
    active always assert atomic bit bool break byte c_code c_decl c_expr c_state c_track chan
    D_proctype d_proctype d_step do else empty enabled equivalent eval eventually false fi for
    full get_priority goto hidden if implies in init inline int len local ltl mtype nempty never
    next nfull not notrace np_ od of pc_value pid print printf printm priority proctype provided
    release return run select set_priority short show skip STDIN stronguntil timeout trace true
    typedef U unless unsigned until V W weakuntil X xr xs
"""
"""Keywords and operators of formulas, as the reader of SPIN 6.5 lists them."""
_VERIFIER = """
    A_V ACCEPT_LAB Air0 Air1 Air2 ALL_P ALPHA_F ASYNC AUTO_RESIZE B_FORCED B_PHASE1 B_PHASE2
    BACKWARD_MOVES BAD BASE BCOMP BCS BFS BFS_DSK_LIMIT BFS_GEN BFS_GLOB BFS_ID BFS_INQ
    BFS_LIMIT BFS_MASK BFS_MAXLOCKS BFS_MAXPROCS BFS_MEM BFS_NORECYCLE BFS_ORD BFS_PRINT
    BFS_RESERVE BFS_STAGGER BFS_STATE BFS_W BITSTATE BYTESIZE CACHE_NR CHECK CHUNK CNT_P
    CNTRSTACK COLLAPSE CONSERVATIVE CONTINUE CONTINUE0 CS_ID CS_N CS_NR DEBUG DELTA errno
    FORWARD_MOVES FREQ FROM_P FULLSTACK G_int G_long GLOBAL GLOBAL_LOCK GN_FRAMES GQ_RD GQ_WR
    HAS_CODE HAS_LAST HAS_LTL HAS_NP HAS_RANDOM HAS_SORTED HAS_TRACK HC HC4 IfNotBlocked INI_P
    INLINE_REV L_BOUND LC LN_FRAMES LOCAL LONG_T LOOPSTATE MA MAX_DSK_FILE MAXPROC MAXQ maxseq0
    maxseq1 MEMCNT MEMLIM MERGED minseq0 minseq1 MORE_P NCLAIMS NCORE NDONE_P NFAIR NIBIS
    NO_LAST NOBOUNDCHECK NOCLAIM NOCOMP NOFAIR NOFIX NOREDUCE NOSTUTTER NOT_AGAIN NP NQS NR_QS
    NRUNS NSUCC NTRANS NUSCC OFFT ONE_L ONESECOND P__Q P_RAND P_REVERSE PAN_H PanSource Pclaim
    PEG PERMUTED PMAX Pp PROG_LAB PUTPID Q_EMPT_F Q_EMPT_T Q_FULL_F Q_FULL_T Q_PROVISO QMAX
    QUERY QUERY_F QUIT R_XPT rand RANDSTOR REACH REVERSE RFLAGS RWFLAGS sa_handler sa_sigaction
    SAFETY SCHED SEP_HEAP SEP_STATE SFH SHORT_T si_addr si_band si_fd si_pid si_status si_value
    sigmask SPACE SpinVersion st_atime st_ctime st_mtime StackSize stderr stdin stdout STORE_CTX
    SVDUMP SYNC T_FREE T_HC T_ID T_RAND T_ROW T_ROW_MASK T_ROW_SIZE T_STAT T_VSZ TIMEOUT_F
    TRANSITIONS TRIX TRY_AGAIN TWIDTH uchar uint ulong UnBlock UPTO_P USE_TDH ushort V_A
    V_PROVISO VECTORSZ VERBOSE VERI VMAX VVERBOSE W_XPT WAIT_MAX wasnew WFLAGS WS XSTACK XUSAFE
    ZAP
"""
"""Macros of the verifier and of the headers that it includes: a member of that name is replaced."""
WORDS = KEYWORDS | frozenset((_PROMELA + _VERIFIER).split())


def is_reserved(name: str) -> bool:
    """Return whether a name is reserved in a model for SPIN."""
    return name in WORDS or MACROS.fullmatch(name) is not None
