"""Instructions that every controller or one of its options has: they write nothing but data that they are given.

Names: ABB technical reference manual RAPID Instructions, Functions and Data types, and the manuals of the options (Arc,
Cap, Spot, Conveyor Tracking, Integrated Vision, Force Control, EGM, Production Monitoring).  Instructions that run a
procedure of the user's are left out: what they write cannot be seen.
"""

from __future__ import annotations

from collections.abc import Mapping

from postproc.rapid.syntax.tokens import word_set

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
