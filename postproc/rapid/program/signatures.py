"""Instructions: the arguments of those that move the arm, and all others that controllers have.

The latter write nothing but data that they are given. Names: ABB technical reference manual RAPID Instructions,
Functions and Data types, and the manuals of the options (Arc, Cap, Spot, Conveyor Tracking, Integrated Vision, Force
Control, EGM, Production Monitoring). Instructions that run a procedure of the user are left out: what they write
cannot be seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache

from postproc.rapid.data.events import Interpolation, Signature
from postproc.rapid.syntax.tokens import word_set

MOVE = ("to", "speed", "zone", "tool")
ARC = ("to", "speed", "seam", "weld", "zone", "tool")
OLD_ARC = ("to", "speed", "seam", "weld", "weave", "zone", "tool")
CAP = ("to", "speed", "cap", "weavestart", "weave", "zone", "tool")
SEARCH = ("signal", "found", "to", "speed", "tool")
TRIGG = ("to", "speed", "trigg", "zone", "tool")
STORED = ("found",)  # what a search stores
SEARCH_STOPS = "where a search stops is known only at run time"


def _circular(roles: tuple[str, ...]) -> tuple[str, ...]:
    """The roles of the circular form of an instruction: ``via`` stands in front of ``to``.

    Args:
        roles: of the positional arguments of its linear form.
    """
    at = roles.index("to")
    return (*roles[:at], "via", *roles[at:])


def _three(
    stem: str, roles: tuple[str, ...], tail: str = "", after: tuple[str, ...] = (), older: tuple[str, ...] = ()
) -> list[Signature]:
    """Signatures of the joint, linear and circular form of one instruction, named ``stem`` + J, L or C + ``tail``.

    Args:
        roles: of the arguments of the linear form; after: roles of the arguments behind them.
        older: roles that S4 programs may use instead of ``after``.
    """
    forms: tuple[tuple[str, Interpolation, tuple[str, ...]], ...] = (
        ("J", "joint", roles), ("L", "line", roles), ("C", "arc", _circular(roles))
    )  # fmt: skip
    return [
        Signature(f"{stem}{letter}{tail}", way, first + after, older=first + older if older else ())
        for letter, way, first in forms
    ]


def _arcs(number: str) -> list[Signature]:
    """Signatures of all arc welding instructions, ArcLStart to ArcCEnd, of one arc system.

    Args:
        number: of the arc system, a digit as in ``ArcL1Start``; empty for instructions without a number.
    """
    signatures = []
    for suffix, phase in (("Start", "start"), ("", "weld"), ("End", "end")):
        signatures.append(Signature(f"ArcL{number}{suffix}", "line", ARC, phase, OLD_ARC))
        signatures.append(Signature(f"ArcC{number}{suffix}", "arc", _circular(ARC), phase, _circular(OLD_ARC)))
    return signatures


def _unsupported(names: str, interpolation: Interpolation, why: str) -> list[Signature]:
    """Signatures, without roles of arguments, of motion instructions whose targets are never changed.

    Args:
        names: of the instructions, with blanks between them; why: the reason that the user is told.
    """
    return [Signature(name, interpolation, (), why_not=why) for name in names.split()]


_OPTION = "the arguments of this instruction are not known to this version"
_ALL = [
    *_three("Move", MOVE),
    *_three("Move", MOVE, "DO", ("signal", "value")),
    *_three("Move", MOVE, "AO", ("signal", "value")),
    *_three("Move", MOVE, "GO", ("signal",), ("signal", "value")),  # the value is \\Value or \\DValue
    *_three("Move", MOVE, "Sync", ("procedure",)),
    *_three("Trigg", TRIGG),
    *_three("ArcMove", MOVE),
    Signature("TriggLIOs", "line", MOVE),
    Signature("TriggJIOs", "joint", MOVE),
    Signature("MoveAbsJ", "absjoint", MOVE, jointed=True),
    Signature("ArcMoveAbsJ", "absjoint", MOVE, jointed=True),
    Signature("TriggAbsJ", "absjoint", TRIGG, jointed=True),
    Signature("MoveExtJ", "none", ("to", "speed", "zone"), jointed=True),
    Signature("ArcMoveExtJ", "none", ("to", "speed", "zone"), older=("to", "speed", "zone", "tool"), jointed=True),
    Signature(
        "SearchExtJ", "none", ("signal", "found", "to", "speed"), jointed=True, why_not=SEARCH_STOPS, results=STORED
    ),
    Signature("SearchL", "line", SEARCH, why_not=SEARCH_STOPS, results=STORED),
    Signature("SearchC", "arc", _circular(SEARCH), why_not=SEARCH_STOPS, results=STORED),
    # SmarTac moves to a start and on until the torch or a sensor touches. The first argument gets the displacement that
    # is found, or whether there is a part; SearchStop the place.
    *(
        Signature(name, "line", STORED, why_not=SEARCH_STOPS, results=(*STORED, "\\searchstop"))
        for name in ("Search_1D", "Search_Groove", "Search_Part")
    ),
    *(s for number in ("", "1", "2", "3", "4", "5", "6") for s in _arcs(number)),
    Signature("CapL", "line", CAP, "weld"),
    Signature("CapC", "arc", _circular(CAP), "weld"),
    *_unsupported("ArcCalcL ArcCalcLStart ArcCalcLEnd ArcAdaptL ArcAdaptLStart ArcAdaptLEnd CapLATR", "line", _OPTION),
    *_unsupported("ArcCalcC ArcCalcCStart ArcCalcCEnd ArcAdaptC ArcAdaptCStart ArcAdaptCEnd CapCATR", "arc", _OPTION),
    *_unsupported("SpotL SpotML CalibL PaintL DispL NutL", "line", _OPTION),
    *_unsupported("FCPressL FCPress1LStart FCPressEnd", "line", _OPTION),
    *_unsupported("SpotJ SpotMJ CalibJ NutJ", "joint", _OPTION),
    *_unsupported("PaintC DispC FCPressC", "arc", _OPTION),
    *_unsupported("EGMMoveL EGMMoveC EGMRunPose EGMRunJoint", "line", "the path comes from a sensor at run time"),
    *_unsupported("ArcRepL StepBwdPath PathRecMoveBwd PathRecMoveFwd", "line", "it replays a stored path"),
]  # fmt: skip

SIGNATURES: dict[str, Signature] = {s.name.lower(): s for s in _ALL}
# Both spellings of a numbered arc system occur: ArcL1Start and ArcLStart1.
SIGNATURES.update(
    (f"{s.name[:4]}{s.name[5:]}{s.name[4]}".lower(), s)
    for s in _ALL
    if s.name.startswith("Arc") and s.name[4:5].isdigit()
)


@cache
def meant_instruction(word: str) -> str:
    """The motion instruction that an unknown word is nearest to, as the manual spells it; empty if none is near."""
    close = get_close_matches(word.lower(), SIGNATURES, n=1, cutoff=0.75)
    return SIGNATURES[close[0]].name if close else ""


# Instructions that only read their arguments.
READ_ONLY = word_set("""
    accset activateparam actunit alarm bookerrno break callbyvar cirpathmode clearpath clkreset clkstart clkstop close
    confj confl corrclear corrwrite deactunit eoffsoff eoffson eoffsset errlog errraise errwrite exit exitcycle gripload
    idelete invertdo isignaldi isignaldo isleep itimer iwatch load mechunitload motionsup pathacclim pdispoff pdispon
    pdispadd pdispset procerrrecovery pulsedo reset restopath set setao setdo setgo settpspeed singarea softact
    softdeact speedrefresh spyoff startload startmove stop stopmove storepath syncmoveoff syncmoveon syncmoveresume
    syncmovesuspend systemstopaction tperase tpshow tpwrite triggequip triggint triggio triggspeed tunereset
    tuneservo uimsgbox uishow unload velset waitai waitdi waitdo waitgi waitgo waitload waitrob waitsynctask waittime
    waituntil worldacclim write writebin writestrbin wzdosetst wzlimsup
    """)
# Instructions that may also write data that they are given by name.
WRITING = word_set("""
    acteventbuffer add aliascamera aliasio aliasioreset arckill arcrefresh bechecktcp bedebugstate
    berefpointer besetuptoolj betcpextend beupdatetcp bitclear bitset brakecheck
    camflush camgetparameter camgetresult camloadjob camreqimage camsetexposure camsetparameter camsetprogrammode
    camsetrunmode camstartloadjob camstartsetparameter camwaitloadjob cancelload capaptrsetup capaptrsetupai
    capaptrsetupao capaptrsetuppers capcondsetdo capequidist caplatrsetup capnoprocess caprefresh capsetstopmode
    capweavesync checkprogref clear cleariobuff clearrawbytes closedir closehighlift cnvgeninstr cnvsync connect
    consolewrite contactl copyfile copyrawbytes cornerpathwarning corrcon corrdiscon cssact cssdeact cssdeactmovel
    cssforceoffsetact cssforceoffsetdeact cssoffsettune cyclicbrakecheck
    deacteventbuffer decr ditheract ditherdeact dropsensor dropwobj
    egmactjoint egmactmove egmactpose egmgetid egmreset egmsetupai egmsetupao egmsetupgi egmsetupltapp egmsetupuc
    egmstop egmstreamstart egmstreamstop erasemodule
    fcact fccalib fccondforce fccondorient fccondpos fccondreorispeed fccondtcpspeed fccondtorque fccondwaitwhile
    fcdeact fcrefcircle fcrefforce fcrefline fcrefmoveframe fcrefrot fcrefspiral fcrefsprforcecart fcrefstart fcrefstop
    fcreftorque fcresetdampingtune fcresetlpfiltertune fcsetdampingtune fcsetlpfiltertune fcspdchgact fcspdchgdeact
    fcspdchgtunreset fcspdchgtunset fcsupvforce fcsupvorient fcsupvpos fcsupvreorispeed fcsupvtcpspeed fcsupvtorque
    fitcircle friccompupdate fricidevaluate fricidinit fricidsetfriclevels
    getdataval getgroupsignalinfo getjointdata getsysdata gettorquemargin gettrapdata hollowwristreset
    icap idisable ienable ierror incr indamove indcmove indcnvaddobject indcnvdisable indcnvenable indcnvinit
    indcnvreset inddmove indgunmove indgunmovereset indreset indrmove initsuperv iobusstart iobusstate iodisable
    ioenable ipathpos ipers irmqmessage isignalai isignalao isignalgi isignalgo ivarvalue
    loadid makedir manloadidproc matrixsolve matrixsolveqr matrixsvd motionprocessmodeset mtoolrotcalib mtooltcpcalib
    open opendir openhighlift packdnheader packrawbytes pathlengthreset pathlengthstart pathlengthstop pathrecstart
    pathrecstop pathresol readanybin readblock readcfgdata readerrdata readrawbytes readvararr recalctcp recordprofile
    recoverymenu recoverymenuwr recoveryposreset recoveryposset removeallcyclicbool removecyclicbool removedir
    removefile removesuperv renamefile resetaxisdistance resetaxismovetime resetppmoved resetretrycount
    resettorquemargin rewind rmqemptyqueue rmqfindslot rmqgetmessage rmqgetmsgdata rmqgetmsgheader rmqreadwait
    rmqsendmessage rmqsendwait safetycontrollersyncrequest save savecfgdata scwrite sendevice setalldataval
    setbrush setbrushfac setdatasearch setdataval setforce setleadthrough setsysdata settmsignal setupcyclicbool
    setupsuperv siclose siconnect sigetcyclic sisetcyclic skipwarn socketaccept socketbind socketclose socketconnect
    socketcreate socketlisten socketreceive socketreceivefrom socketsend socketsendto softelbow speedlimaxis
    speedlimcheckpoint spystart spystop startmoveretry stcalib stclose stepbwdpath stindgun stindgunreset
    stoolrotcalib stooltcpcalib stopen stopmovereset storeprofile sttune sttunereset supsyncsensoroff supsyncsensoron
    syncmoveundo synctosensor syncwwobj testsigndefine testsignreset texttabinstall tpreaddnum tpreadfk tpreadnum
    triggcheckio triggdatacopy triggdatareset triggrampao triggstopproc tryint uimsgwrite uimsgwriteabort
    unpackrawbytes useaccprofile usereachabletargets waitandrecprof waitsensor waittestandset waitwobj warmstart
    writeanybin writeblock writecfgdata writerawbytes writevar writevararr wzboxdef wzcyldef wzdisable wzdoset
    wzenable wzfree wzhomejointdef wzlimjointdef wzsphdef
    """)
KNOWN_INSTRUCTIONS = READ_ONLY | WRITING
# Of these, what moves the arm by itself, or lets something else move it: calibration and load identification, force
# control, a sensor or a computer that guides the arm, soft servo, single axes, spot guns, steps back along the path.
MOVING = word_set("""
    bechecktcp besetuptoolj betcpextend beupdatetcp brakecheck contactl cssact cssdeactmovel cyclicbrakecheck
    egmactjoint egmactmove egmactpose egmstreamstart fcact fcrefcircle fcrefforce fcrefline fcrefmoveframe fcrefrot
    fcrefspiral fcrefsprforcecart fcrefstart fcreftorque fricidevaluate indamove indcmove inddmove indgunmove indrmove
    loadid manloadidproc mtoolrotcalib mtooltcpcalib setleadthrough stcalib stepbwdpath stindgun stoolrotcalib
    stooltcpcalib synctosensor syncwwobj
    """)
# These go on writing what they are given, at any moment from then on.
LASTING = frozenset({"ivarvalue", "setupcyclicbool", "sigetcyclic"})
COUNTING = ("incr", "decr", "add", "clear")  # these write their first argument and do nothing else
# Arguments that instructions of ``READ_ONLY`` write.
WRITTEN = ("\\timeflag", "\\valueattimeout", "\\result", "\\breakflag", "\\instanceid")
# State that instructions change, by instruction.
STATE_OF_INSTRUCTION: Mapping[str, str] = {
    "gripload": "@gripload", "pdispset": "@pdisp", "pdispadd": "@pdisp", "pdispon": "@pdisp", "pdispoff": "@pdisp",
    "eoffsset": "@eoffs", "eoffson": "@eoffs", "eoffsoff": "@eoffs", "confl": "@conf_l", "confj": "@conf_j",
    "singarea": "@singarea", "velset": "@velset", "accset": "@accset", "actunit": "@units", "deactunit": "@units",
    "softact": "@soft", "softdeact": "@soft",
}  # fmt: skip
# And what to call it.
SETTERS: Mapping[str, str] = {
    "@gripload": "GripLoad", "@pdisp": "PDispSet or PDispOn", "@eoffs": "EOffsSet or EOffsOn", "@conf_l": "ConfL",
    "@conf_j": "ConfJ", "@singarea": "SingArea", "@velset": "VelSet", "@accset": "AccSet",
    "@units": "ActUnit or DeactUnit", "@soft": "SoftAct",
}  # fmt: skip
