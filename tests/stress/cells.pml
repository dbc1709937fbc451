/* How cells move between ranks, as docs/ranks.md says it, for the model checker Spin.

   A second formalism beside tests/stress/exploration.py, which explores the code that
   ships: here the rules are written down once more, from the page and not from the
   code. More is allowed than the code does: any holder may be told to pass a cell on,
   any replica may be asked to adopt it, and any cell that may go may be the victim.

   SYSTEM chooses ranks, cells, caches and the cells that each rank's rays visit.
   NO_DEFERRAL, NO_ORDER, NO_ANSWER, NO_ROOM and LEAVING each take a rule away. STILL
   claims that no cell ever changes its owner, which must be refuted.

   Never two packets of rays at a rank, without which rule 6 decides nothing, no edits
   and no cancelled frames: those are in the exploration of the code. */

#define RANKS 3
#define CELLS 3
#define MOST_ASKED 2
#define LONG 3          /* visits of a rank, at most */
#define NONE 7

#ifndef SYSTEM
#define SYSTEM 1
#endif

mtype = { REQUEST, FORWARD, DATA, WISH, INVALIDATE, KEEP, ADOPT, ADOPTED };
mtype = { INVALID, PENDING, VALID, ASKED };

/* From rank s to rank t: one channel for all kinds, as rule 2 wants it. */
chan line[RANKS * RANKS] = [6] of { mtype, byte, byte };
#define to(s, t) line[(s) * RANKS + (t)]

typedef Rank {
  mtype state[CELLS] = INVALID;
  bit own[CELLS];
  bit kept[CELLS];
  bit fresh[CELLS];
  byte deferred[CELLS];         /* a bit for each rank to be served when it came */
  byte used;                    /* slots taken */
  byte owned;
  byte asked;                   /* wishes to drop that are not answered */
  byte next;                    /* number of the next visit */
  byte slots;
  byte quota;
};
Rank rank[RANKS];

typedef Home {
  byte owner;
  byte replicas;                /* a bit for each */
  byte asked;                   /* of the replicas, to adopt */
  byte heir;                    /* the last of them */
  byte times;
  byte home;
};
Home entry[CELLS];

byte visit[RANKS * LONG];
#define wanted(me) visit[(me) * LONG + rank[me].next]
#define finished(me) (rank[me].next == LONG || wanted(me) == NONE)
#define holds(r, c) (rank[r].state[c] == VALID || rank[r].state[c] == ASKED)
#define has(set, r) (((set) >> (r)) & 1)

byte moved;                     /* cells that have changed their owner */

inline deal(c, first, at) {
  entry[c].owner = first; entry[c].home = at;
  rank[first].state[c] = VALID; rank[first].own[c] = 1;
  rank[first].used++; rank[first].owned++
}

inline cache(r, slots_, quota_) { rank[r].slots = slots_; rank[r].quota = quota_ }

inline look(r, a, b, c) {
  visit[(r) * LONG] = a; visit[(r) * LONG + 1] = b; visit[(r) * LONG + 2] = c
}

/* I8: what is in flight is bounded; a full line would be an error. */
#define say(S, T, KIND, C, W) assert(nfull(to(S, T))); to(S, T)!KIND(C, W)

/* The home looks for a new owner among replicas that were not asked. */
inline find_owner() {
  if
  :: (entry[c].replicas & ~entry[c].asked) == 0 || entry[c].times == MOST_ASKED ->
     entry[c].asked = 0; entry[c].times = 0; entry[c].heir = NONE;
#ifndef NO_ANSWER
     say(me, entry[c].owner, KEEP, c, 0)
#endif
  :: else ->
     if
     :: has(entry[c].replicas & ~entry[c].asked, 0) -> entry[c].heir = 0
     :: has(entry[c].replicas & ~entry[c].asked, 1) -> entry[c].heir = 1
     :: has(entry[c].replicas & ~entry[c].asked, 2) -> entry[c].heir = 2
     fi;
     entry[c].asked = entry[c].asked | (1 << entry[c].heir);
     entry[c].times++;
     say(me, entry[c].heir, ADOPT, c, 0)
  fi
}

/* Message k of cell c, with w, has come to rank me from s. */
inline handle() {
  if
  :: k == REQUEST ->
     assert(entry[c].home == me);
     assert(s != entry[c].owner && !has(entry[c].replicas, s));
     if                         /* any holder may be the closest */
     :: s != 0 && (entry[c].owner == 0 || has(entry[c].replicas, 0)) -> t = 0
     :: s != 1 && (entry[c].owner == 1 || has(entry[c].replicas, 1)) -> t = 1
     :: s != 2 && (entry[c].owner == 2 || has(entry[c].replicas, 2)) -> t = 2
     fi;
     entry[c].replicas = entry[c].replicas | (1 << s);          /* rule 1 */
     say(me, t, FORWARD, c, s)
  :: k == FORWARD ->
     assert(rank[me].state[c] != INVALID);                      /* I3 */
     if
     :: rank[me].state[c] == PENDING ->
#ifdef NO_DEFERRAL
        assert(false)           /* there is nothing to send */
#else
        rank[me].deferred[c] = rank[me].deferred[c] | (1 << w)
#endif
     :: else ->
        rank[me].kept[c] = 0;
        say(me, w, DATA, c, 0)
     fi
  :: k == DATA ->
     assert(rank[me].state[c] == PENDING);                      /* I3 */
     rank[me].state[c] = VALID;
     rank[me].fresh[c] = 1;                                     /* rule 6 */
     t = 0;
     do
     :: t < RANKS ->
        if
        :: has(rank[me].deferred[c], t) -> say(me, t, DATA, c, 0)
        :: else
        fi;
        t++
     :: else -> break
     od;
     rank[me].deferred[c] = 0
  :: k == WISH ->
     assert(entry[c].home == me);
     if
     :: has(entry[c].replicas, s) ->                            /* rule 4 */
        entry[c].replicas = entry[c].replicas & ~(1 << s);
        say(me, s, INVALIDATE, c, 0)
     :: else ->
        assert(s == entry[c].owner && entry[c].heir == NONE);
        find_owner()
     fi
  :: k == INVALIDATE ->
     assert(rank[me].state[c] == ASKED);                        /* I3 */
     rank[me].owned = rank[me].owned - rank[me].own[c];
     rank[me].state[c] = INVALID;
     rank[me].own[c] = 0; rank[me].kept[c] = 0; rank[me].fresh[c] = 0;
     rank[me].used--; rank[me].asked--
  :: k == KEEP ->
     assert(rank[me].state[c] == ASKED);                        /* I3 */
     rank[me].state[c] = VALID; rank[me].kept[c] = 1; rank[me].asked--
  :: k == ADOPT ->
     if
     :: rank[me].state[c] == VALID && !rank[me].own[c] &&
        rank[me].owned < rank[me].quota ->
        rank[me].own[c] = 1; rank[me].kept[c] = 0; rank[me].owned++;
        say(me, s, ADOPTED, c, 1)
     :: else ->
        say(me, s, ADOPTED, c, 0)
     fi
  :: k == ADOPTED ->
     assert(entry[c].home == me && entry[c].heir == s);
     if
     :: w ->
        assert(has(entry[c].replicas, s));
        t = entry[c].owner;
        entry[c].owner = s;
        entry[c].replicas = entry[c].replicas & ~(1 << s);
        entry[c].asked = 0; entry[c].times = 0; entry[c].heir = NONE;
        moved++;
        say(me, t, INVALIDATE, c, 0)
     :: else ->
        find_owner()
     fi
  fi;
  t = 0; k = REQUEST; c = 0; w = 0; s = 0
}

#define may_go(r, c) (rank[r].state[c] == VALID && !rank[r].kept[c] && !rank[r].fresh[c])

#ifdef LEAVING
#define serves(me) (!finished(me))
#else
#define serves(me) true         /* rule 7: it goes on serving */
#endif

#ifdef NO_ORDER
/* One probe for each kind: the first of a kind comes, whatever was sent before it. */
#define from(q) serves(me) && nempty(to(q, me)) -> s = q;         \
  if                                                              \
  :: to(q, me)??[REQUEST, c, w] -> to(q, me)??REQUEST(c, w); k = REQUEST  \
  :: to(q, me)??[FORWARD, c, w] -> to(q, me)??FORWARD(c, w); k = FORWARD  \
  :: to(q, me)??[DATA, c, w] -> to(q, me)??DATA(c, w); k = DATA           \
  :: to(q, me)??[WISH, c, w] -> to(q, me)??WISH(c, w); k = WISH           \
  :: to(q, me)??[INVALIDATE, c, w] -> to(q, me)??INVALIDATE(c, w); k = INVALIDATE \
  :: to(q, me)??[KEEP, c, w] -> to(q, me)??KEEP(c, w); k = KEEP           \
  :: to(q, me)??[ADOPT, c, w] -> to(q, me)??ADOPT(c, w); k = ADOPT        \
  :: to(q, me)??[ADOPTED, c, w] -> to(q, me)??ADOPTED(c, w); k = ADOPTED  \
  fi
#else
#define from(q) serves(me) && nempty(to(q, me)) -> s = q; to(q, me)?k(c, w)
#endif

proctype node(byte me) {
  mtype k = REQUEST;
  byte c, w, s, t;
end:                            /* it may wait here for ever: `watch` says when not */
  do
  :: atomic { from(0); handle() }
  :: atomic { from(1); handle() }
  :: atomic { from(2); handle() }
  :: atomic {                   /* a ray visits a cell that is here */
       !finished(me) && holds(me, wanted(me)) ->
       rank[me].fresh[wanted(me)] = 0;
       rank[me].next++
     }
  :: atomic {                   /* a slot is reserved before a cell is asked for */
       !finished(me) && rank[me].state[wanted(me)] == INVALID &&
       rank[me].used < rank[me].slots ->
       c = wanted(me);
       rank[me].state[c] = PENDING;
       rank[me].used++;
       assert(rank[me].used <= rank[me].slots);                 /* I4 */
       say(me, entry[c].home, REQUEST, c, 0);
       c = 0
     }
  :: atomic {                   /* no slot is free: ask whether a cell may go */
       !finished(me) && rank[me].state[wanted(me)] == INVALID &&
       rank[me].used == rank[me].slots && rank[me].asked == 0 ->
       if
       :: may_go(me, 0) -> c = 0
       :: may_go(me, 1) -> c = 1
       :: may_go(me, 2) -> c = 2
       fi;
       rank[me].state[c] = ASKED;
       rank[me].asked++;
       say(me, entry[c].home, WISH, c, 0);
       c = 0
     }
  od
}

/* When nothing can happen any more: everybody is finished, nothing is under way (I5),
   and every cell has one owner who has it (I1). */
proctype watch() {
  byte i, j, owners;
  timeout ->
  d_step {
    do
    :: i < RANKS ->
       assert(finished(i) && rank[i].asked == 0 && rank[i].owned <= rank[i].quota);
       i++
    :: else -> break
    od;
#ifdef STILL
    assert(moved == 0);         /* fails: shows that owners do change */
#endif
    i = 0;
    do
    :: i < RANKS * RANKS -> assert(empty(line[i])); i++
    :: else -> break
    od;
    i = 0;
    do
    :: i < CELLS && entry[i].owner != NONE ->
       j = 0; owners = 0;
       do
       :: j < RANKS ->
          owners = owners + rank[j].own[i];
          /* I2: listed are those who have it, and nobody else */
          assert(holds(j, i) == (entry[i].owner == j || has(entry[i].replicas, j)));
          j++
       :: else -> break
       od;
       assert(owners == 1 && rank[entry[i].owner].own[i]);
       i++
    :: else -> break
    od
  }
}

init {
  byte i;
  atomic {
    do
    :: i < CELLS -> entry[i].owner = NONE; entry[i].heir = NONE; i++
    :: else -> break
    od;
#if SYSTEM == 1                 /* two cells; the third rank owns nothing, has one slot */
    cache(0, 2, 1); cache(1, 2, 1); cache(2, 1, 0);
    deal(0, 0, 2); deal(1, 1, 0);
    look(0, 1, 0, NONE); look(1, 0, NONE, NONE); look(2, 0, 1, NONE);
#elif SYSTEM == 2               /* one slot to work with, one to adopt: owners change */
    cache(0, 2, 1); cache(1, 3, 2); cache(2, 2, 1);
    deal(0, 0, 2); deal(1, 1, 0); deal(2, 2, 1);
    look(0, 1, 2, NONE); look(1, 0, NONE, NONE); look(2, 1, NONE, NONE);
#elif SYSTEM == 3               /* one slot to work with at each rank, three cells */
    cache(0, 2, 1); cache(1, 2, 1); cache(2, 2, 1);
    deal(0, 0, 1); deal(1, 1, 2); deal(2, 2, 0);
    look(0, 1, 2, NONE); look(1, 2, 0, NONE); look(2, 0, 1, NONE);
#else                           /* room to adopt everywhere, and rays that come back */
    cache(0, 2, 1); cache(1, 3, 2); cache(2, 3, 2);
    deal(0, 0, 2); deal(1, 1, 2); deal(2, 2, 0);
    look(0, 1, 2, 0); look(1, 0, 2, 1); look(2, 1, 0, 2);
#endif
#ifdef NO_ROOM                  /* every slot may be owned */
    i = 0;
    do
    :: i < RANKS -> rank[i].slots = rank[i].owned; rank[i].quota = rank[i].owned; i++
    :: else -> break
    od;
#endif
    run node(0); run node(1); run node(2); run watch()
  }
}
