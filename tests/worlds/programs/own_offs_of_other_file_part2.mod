! Its Offs counts z downwards.
MODULE OwnOffsLib
  FUNC robtarget Offs(robtarget p,num dx,num dy,num dz)
    p.trans:=p.trans+[dx,dy,-dz];
    RETURN p;
  ENDFUNC
ENDMODULE
